// Tests a device that nobody holds. The displayed force accelerates its handle, so the safety chain must set the force
// to zero. It must not do so for a hand that moves fast.
#include <gtest/gtest.h>

#include <chrono>

#include "common/haptics/safety.hpp"

namespace tandem::haptics {
namespace {

SafetyInput input_with(const Vec3& force) {
  SafetyInput input;
  input.wrench.f = force;
  input.has_state = true;
  return input;
}

struct Rig {
  Wrench tick(const SafetyInput& input) {
    now += std::chrono::milliseconds(1);
    return out = chain.apply(now, input);
  }
  void run(const SafetyInput& input, int ticks) {
    for (int i = 0; i < ticks; ++i) tick(input);
  }

  SafetyChain chain{SafetySettings{}};
  LocalTime now{};
  Wrench out;
};

/// A released device is modelled as a mass on which only the displayed force acts.
TEST(SafetyDrivenOff, AHandleThatNobodyHoldsIsLetGoWithinTwentyMillisecondsOfRunningOffAndReArmed) {
  for (const double mass_kg : {0.035, 0.15, 0.35}) {
    Rig rig;
    SafetyInput input = input_with(Vec3(0, 0, 5));
    rig.run(input, 600);
    int fast_ticks = 0;
    double v = 0;
    for (int i = 0; i < 500 && (v <= 1 || !rig.out.f.isZero(0)); ++i) {
      v += rig.out.f.z() / mass_kg * 0.001;
      input.handle_v = Vec3(0, 0, v);
      input.handle_speed_m_per_s = v;
      fast_ticks += v > 1 ? 1 : 0;
      rig.tick(input);
    }
    EXPECT_TRUE(rig.out.f.isZero(0)) << mass_kg << " kg";
    EXPECT_LE(fast_ticks, 20) << mass_kg << " kg";
    EXPECT_LE(v, 1 + 0.02 * 5 / mass_kg) << mass_kg << " kg";
    input.handle_v.setZero();
    input.handle_speed_m_per_s = 0;
    Vec3 last = rig.out.f;
    for (int i = 0; i < 600; ++i) {
      rig.tick(input);
      ASSERT_LE((rig.out.f - last).norm(), 5.0 / 500 + 1e-9) << "by the ramp";
      last = rig.out.f;
    }
    EXPECT_NEAR(rig.out.f.z(), 5, 1e-9);
  }
}

TEST(SafetyDrivenOff, AFastHandThatNoForceDrivesKeepsItsForce) {
  Rig rig;
  SafetyInput input = input_with(Vec3(0, 0, 3));
  for (const Vec3& v : {Vec3(2, 0, 0), Vec3(0, 0, -2), Vec3(0, 0, 0.9)}) {
    input.handle_v = v;
    input.handle_speed_m_per_s = v.norm();
    rig.run(input, 600);
    EXPECT_NEAR(rig.out.f.z(), 3, 1e-9) << v.transpose();
  }
}

}  // namespace
}  // namespace tandem::haptics
