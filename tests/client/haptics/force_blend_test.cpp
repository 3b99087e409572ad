// Compares the decay of a force jump with its closed form, and checks the bound on its change per tick.
#include "client/haptics/stages/force_blend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::client {
namespace {

constexpr double kForceBlendTick_s = 0.001;

Wrench force_x(double f) {
  return {Vec3(f, 0, 0), Vec3::Zero()};
}

/// Returns a blend whose last displayed force is `f` along x.
ForceBlend showing(double f) {
  ForceBlend blend;
  blend.apply(force_x(f));
  return blend;
}

TEST(ForceBlend, AJumpOfTheTargetIsNotAJumpOfTheOutput) {
  ForceBlend blend = showing(3);
  blend.jump();
  EXPECT_EQ(blend.apply(force_x(-1)).f.x(), 3);
}

TEST(ForceBlend, WithoutAJumpTheTargetIsShown) {
  ForceBlend blend = showing(3);
  EXPECT_EQ(blend.apply(force_x(-1)).f.x(), -1);
}

TEST(ForceBlend, AContactShortlyAfterAJumpHasItsFullStiffness) {
  ForceBlend blend = showing(0);
  blend.jump();
  blend.apply(force_x(0.01));
  blend.advance(kForceBlendTick_s);
  EXPECT_NEAR(blend.apply(force_x(-5)).f.x(), -5, 0.01);
}

TEST(ForceBlend, FollowsTheCriticallyDampedCurveWhateverThePeriod) {
  for (const double period_s : {0.0001, 0.001, 0.0037}) {
    ForceBlend blend = showing(2);
    blend.jump();
    blend.apply(force_x(0));
    double t = 0;
    for (int k = 0; k < 30; ++k) {
      blend.advance(period_s);
      t += period_s;
      const double wt = ForceBlend::kRate * t;
      ASSERT_NEAR(blend.apply(force_x(0)).f.x(), 2 * (1 + wt) * std::exp(-wt), 1e-12);
    }
  }
}

TEST(ForceBlend, NoStepExceedsTheBoundAndTheOffsetEndsWithin100Ms) {
  ForceBlend blend = showing(4);
  blend.jump();
  blend.apply(force_x(0));
  double before = 4;
  for (int k = 0; k < 100; ++k) {
    blend.advance(kForceBlendTick_s);
    const double now = blend.apply(force_x(0)).f.x();
    ASSERT_LE(now, before);
    // After a jump of 1 N, the rest w(t) of the jump decays with |ẇ| = ω² t e^(−ωt), where ω = kRate. Its maximum is ω
    // / e, at t = 1/ω. The jump here is 4 N.
    ASSERT_LE(before - now, 4 * ForceBlend::kRate * kForceBlendTick_s / std::exp(1.0));
    before = now;
    EXPECT_LT(now, k < 49 ? 4.0 : k < 84 ? 0.10 * 4 : 0.01 * 4) << k;
  }
}

// The target force jumps and then returns to zero. Fails if the rest of the jump is still added to the zero target: the
// displayed force would be opposite to a force that has vanished.
TEST(ForceBlend, ATargetThatComesBackByItselfIsNotAnswered) {
  ForceBlend blend = showing(0);
  blend.jump();
  for (int k = 0; k < 100; ++k) {
    blend.advance(kForceBlendTick_s);
    const double shown = blend.apply(force_x(6 * std::exp(-k / 10.0))).f.x();
    EXPECT_GE(shown, -1e-9) << k;
    EXPECT_LE(shown, 1.5) << k;
  }
}

TEST(ForceBlend, JumpsAmidAFadeAddUpAndKeepTheBoundOfTheirSum) {
  ForceBlend blend = showing(0);
  double target = 0, jumps = 0, shown = 0;
  for (int k = 0; k < 300; ++k) {
    blend.advance(kForceBlendTick_s);
    if (k % 20 == 0 && k < 200) {
      const double to = k % 40 == 0 ? 1.5 : -0.5;
      blend.jump();
      jumps += std::abs(to - target);
      target = to;
    }
    const double now = blend.apply(force_x(target)).f.x();
    ASSERT_LE(std::abs(now - shown), jumps * ForceBlend::kRate * kForceBlendTick_s / std::exp(1.0) + 1e-12) << k;
    shown = now;
  }
  EXPECT_NEAR(shown, target, 1e-2);
}

TEST(ForceBlend, IgnoresAForceThatIsNotFinite) {
  ForceBlend blend = showing(1);
  blend.apply(force_x(std::numeric_limits<double>::infinity()));
  blend.jump();
  blend.advance(std::nan(""));
  EXPECT_EQ(blend.apply(force_x(5)).f.x(), 1) << "as if the infinite had not been";
}

}  // namespace
}  // namespace tandem::client
