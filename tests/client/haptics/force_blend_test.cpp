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
    // Bound of the change per tick. After a jump by J = 4 N, the blend adds a rest w(t) that decays with the rate ω =
    // kRate. Its slope |ẇ| = J ω² t e^(−ωt) is largest at t = 1/ω, where it is J ω / e.
    ASSERT_LE(before - now, 4 * ForceBlend::kRate * kForceBlendTick_s / std::exp(1.0));
    before = now;
    EXPECT_LT(now, k < 49 ? 4.0 : k < 84 ? 0.10 * 4 : 0.01 * 4) << k;
  }
}

// The target force jumps to 6 N and decays to zero by itself. Fails if the blend still subtracts the rest of the jump:
// the displayed force would become negative.
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
