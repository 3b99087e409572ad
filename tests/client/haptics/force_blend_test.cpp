// The fading of a jump against its closed form, and the bound on its steps.
#include "client/haptics/stages/force_blend.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tandem::client {
namespace {

constexpr double kTick_s = 0.001;

Wrench force_x(double f) {
  return {Vec3(f, 0, 0), Vec3::Zero()};
}

TEST(ForceBlend, AJumpOfTheTargetIsNoJumpOfWhatIsShown) {
  ForceBlend blend;
  blend.jump(force_x(3), force_x(-1));
  EXPECT_EQ(blend.apply(force_x(-1)).f.x(), 3);
}

TEST(ForceBlend, FollowsTheCriticallyDampedCurveWhateverThePeriod) {
  for (const double period_s : {0.0001, 0.001, 0.0037}) {
    ForceBlend blend;
    blend.jump(force_x(2), force_x(0));
    double t = 0;
    for (int k = 0; k < 30; ++k) {
      blend.advance(period_s);
      t += period_s;
      const double wt = ForceBlend::kRate * t;
      ASSERT_NEAR(blend.offset().f.x(), 2 * (1 + wt) * std::exp(-wt), 1e-12);
    }
  }
}

TEST(ForceBlend, NoStepIsLargerThanTheBoundAndItIsGoneInAHundredMilliseconds) {
  ForceBlend blend;
  blend.jump(force_x(4), force_x(0));
  double before = 4;
  for (int k = 0; k < 100; ++k) {
    blend.advance(kTick_s);
    const double now = blend.offset().f.x();
    ASSERT_LE(now, before);
    // |ȯ| = Δ ω² t e^(−ωt) is largest at t = 1/ω: Δ ω / e.
    ASSERT_LE(before - now, 4 * ForceBlend::kRate * kTick_s / std::exp(1.0));
    before = now;
    EXPECT_LT(now, k < 49 ? 4.0 : k < 84 ? 0.10 * 4 : 0.01 * 4) << k;
  }
}

TEST(ForceBlend, JumpsAmidAFadeAddUpAndKeepTheBoundOfTheirSum) {
  ForceBlend blend;
  double target = 0, jumps = 0, shown = 0, slope = 0;
  for (int k = 0; k < 300; ++k) {
    blend.advance(kTick_s);
    if (k % 20 == 0 && k < 200) {
      const double to = k % 40 == 0 ? 1.5 : -0.5;
      blend.jump(force_x(target), force_x(to));
      jumps += std::abs(to - target);
      target = to;
    }
    const double now = blend.apply(force_x(target)).f.x();
    const double bound = jumps * ForceBlend::kRate * kTick_s / std::exp(1.0);
    ASSERT_LE(std::abs(now - shown), bound + 1e-12) << k;
    // C¹: the slope of the sum of all fades changes by no more than ω² T of what is left to fade.
    ASSERT_LE(std::abs((now - shown) - slope), jumps * std::pow(ForceBlend::kRate * kTick_s, 2) + 1e-12) << k;
    slope = now - shown;
    shown = now;
  }
  EXPECT_NEAR(shown, target, 1e-2);
}

TEST(ForceBlend, IgnoresAJumpThatIsNotFinite) {
  ForceBlend blend;
  blend.jump(force_x(std::numeric_limits<double>::infinity()), force_x(0));
  blend.jump(force_x(0), force_x(std::nan("")));
  blend.advance(std::nan(""));
  EXPECT_EQ(blend.offset().f.norm(), 0);
}

}  // namespace
}  // namespace tandem::client
