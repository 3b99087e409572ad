// Tests each guarantee of the safety chain with inputs that could break it.
#include "common/haptics/safety.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace tandem::haptics {
namespace {

constexpr Duration kSafetyTick{std::chrono::milliseconds(1)};
// Bound of the rounding error of a few operations on numbers of the order of 10.
constexpr double kSafetyRounding = 1e-12;

SafetyInput good_input(const Vec3& force_n = Vec3(0, 0, 3)) {
  SafetyInput input;
  input.wrench.f = force_n;
  input.wrench.t = 0.02 * force_n;
  input.has_state = true;
  return input;
}

/// A safety chain with a virtual clock that ticks at 1 kHz.
struct SafetyRig {
  explicit SafetyRig(const SafetySettings& settings = {}) : chain(settings) {}

  Wrench tick(const SafetyInput& input) {
    now += kSafetyTick;
    out = chain.apply(now, input);
    return out;
  }
  void run(const SafetyInput& input, int ticks) {
    for (int i = 0; i < ticks; ++i) tick(input);
  }
  int ticks_until_zero(const SafetyInput& input, int at_most) {
    for (int i = 1; i <= at_most; ++i) {
      tick(input);
      if (out.f.isZero(0) && out.t.isZero(0)) return i;
    }
    return at_most + 1;
  }

  SafetyChain chain;
  LocalTime now{std::chrono::seconds(5)};
  Wrench out;
};

// Returns settings with a slew rate below that of any device: a change of 3 N takes 3 s. If the force decays faster,
// the cause must be the gain of the safety chain and not the slew limit.
SafetySettings slow_slew() {
  SafetySettings settings;
  settings.slew_n_per_s = 1.0;
  settings.slew_n_m_per_s = 0.02;
  return settings;
}

TEST(Safety, RampReachesFullForceAfterItsTimeAndIsLinear) {
  SafetyRig rig;
  const SafetyInput input = good_input();
  rig.tick(input);
  EXPECT_EQ(rig.out.f.norm(), 0) << "the first tick has no time behind it";
  rig.run(input, 250);
  EXPECT_NEAR(rig.out.f.z(), 1.5, 1e-9);
  EXPECT_TRUE(rig.chain.faults() & kSafetyRamping);
  rig.run(input, 250);
  EXPECT_NEAR(rig.out.f.z(), 3.0, 1e-9);
  rig.tick(input);
  EXPECT_EQ(rig.chain.faults(), 0U);
}

TEST(Safety, RampAndSlewDependOnTimeNotOnTheRateOfTheLoop) {
  for (const auto period : {std::chrono::microseconds(250), std::chrono::microseconds(2000)}) {
    SafetySettings settings;
    settings.tick = period;
    SafetyChain chain(settings);
    LocalTime now{std::chrono::seconds(5)};
    Wrench out;
    for (Duration at{0}; at <= std::chrono::milliseconds(250); at += period) out = chain.apply(now + at, good_input());
    EXPECT_NEAR(out.f.z(), 1.5, 1e-9) << period / std::chrono::microseconds(1) << " us";
    EXPECT_EQ(chain.faults(), kSafetyRamping);
  }
}

TEST(Safety, NothingIsDisplayedBeforeTheFirstState) {
  SafetyRig rig;
  SafetyInput input = good_input();
  input.has_state = false;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(rig.tick(input).f.isZero(0));
  EXPECT_TRUE(rig.chain.faults() & kSafetySilence);
  EXPECT_TRUE(rig.chain.is_quiet());
}

TEST(Safety, AForceThatMayNotBeDisplayedFadesWithinTheFaultTime) {
  SafetyRig rig;
  SafetyInput input = good_input();
  rig.run(input, 600);
  input.is_displaying = false;
  EXPECT_LE(rig.ticks_until_zero(input, 100), 20);
  EXPECT_EQ(rig.chain.faults(), kSafetyNotDisplaying);
  EXPECT_EQ(describe_safety_faults(rig.chain.faults()), "not_displaying");
  input.is_displaying = true;
  rig.tick(input);
  EXPECT_EQ(rig.chain.faults(), kSafetyRamping);
}

TEST(Safety, ATooSlowLoopOrRoomReleasesTheForce) {
  for (const bool is_room : {false, true}) {
    SafetyRig rig;
    SafetyInput input = good_input();
    rig.run(input, 600);
    ASSERT_EQ(rig.out.f.z(), 3.0);
    input.is_room_slow = is_room;
    double largest_step_n = 0;
    for (int i = 0; i < 200; ++i) {
      const double before_n = rig.out.f.z();
      if (!is_room) rig.now += kSafetyTick / 4;
      rig.tick(input);
      largest_step_n = std::max(largest_step_n, std::abs(rig.out.f.z() - before_n));
    }
    EXPECT_TRUE(rig.chain.is_quiet());
    EXPECT_EQ(describe_safety_faults(rig.chain.faults()), "slow");
    EXPECT_LE(largest_step_n, 3.0 / 15 * 1.25 + kSafetyRounding) << "in 15 ms, as after any fault";
    input.is_room_slow = false;
    rig.run(input, 150);
    EXPECT_TRUE(rig.chain.faults() & kSafetyRamping) << "back by the ramp";
    EXPECT_LT(rig.out.f.z(), 1.0);
  }
}

TEST(Safety, SlewBoundsEachChangeOfForceAndTorque) {
  SafetySettings settings;
  settings.slew_n_per_s = 100;
  settings.slew_n_m_per_s = 1;
  SafetyRig rig(settings);
  rig.run(good_input(Vec3::Zero()), 600);
  SafetyInput input = good_input();
  input.wrench.t = Vec3(0.5, 0, 0);
  rig.tick(input);
  EXPECT_NEAR(rig.out.f.norm(), 0.1, kSafetyRounding);
  EXPECT_NEAR(rig.out.t.norm(), 0.001, kSafetyRounding);
  EXPECT_TRUE(rig.chain.faults() & kSafetySlewed);
  rig.run(input, 600);
  EXPECT_NEAR(rig.out.f.z(), 3.0, kSafetyRounding);
  EXPECT_FALSE(rig.chain.faults() & kSafetySlewed);
}

TEST(Safety, SilenceDecaysBetweenItsTwoAgesForAnySlewLimit) {
  for (const SafetySettings& settings : {SafetySettings{}, slow_slew()}) {
    SafetyRig rig(settings);
    rig.run(good_input(), 5000);
    ASSERT_NEAR(rig.out.f.z(), 3.0, 1e-9);
    SafetyInput input = good_input();
    for (int age_ms = 1; age_ms <= 150; ++age_ms) {
      input.state_age = std::chrono::milliseconds(age_ms);
      rig.tick(input);
      const double left = std::clamp((148.0 - age_ms) / 33.0, 0.0, 1.0);
      const double expected_n = 3.0 * left * left * left * (10 - 15 * left + 6 * left * left);
      ASSERT_NEAR(rig.out.f.z(), expected_n, 1e-9) << "age " << age_ms << " ms";
      ASSERT_NEAR(rig.out.t.z(), 0.02 * expected_n, 1e-9) << "age " << age_ms << " ms";
    }
    EXPECT_TRUE(rig.out.f.isZero(0));
    EXPECT_TRUE(rig.chain.is_quiet());
  }
}

TEST(Safety, LosingTheSessionFadesToZeroWithinTwentyMillisecondsWithoutAStep) {
  for (const SafetySettings& settings : {SafetySettings{}, slow_slew()}) {
    SafetyRig rig(settings);
    rig.run(good_input(), 5000);
    SafetyInput absent;  // no state, and a computed force of zero
    for (int i = 1; i <= 20; ++i) {
      rig.tick(absent);
      ASSERT_NEAR(rig.out.f.z(), std::max(0.0, 3.0 * (1 - i / 15.0)), 1e-9) << i << " ms";
    }
    EXPECT_TRUE(rig.chain.is_quiet());
  }
}

TEST(Safety, StateAfterSilenceIsRampedInFromZero) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  SafetyInput silent = good_input();
  silent.state_age = std::chrono::seconds(1);
  rig.run(silent, 16);
  ASSERT_TRUE(rig.out.f.isZero(0));
  rig.run(good_input(), 250);
  EXPECT_NEAR(rig.out.f.z(), 1.5, 1e-9);
}

/// For a short time no states arrive. The time is too short for the force to become zero. Meanwhile, the computed force
/// rises by 5 N/s. Fails if the displayed force jumps when states arrive again.
class ShortSilence : public testing::TestWithParam<int> {};

TEST_P(ShortSilence, BeginsAndEndsWithoutStepOrCorner) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  double steepest_n = 0, sharpest_n = 0, most_missing_n = 0;
  double before_n = 3, rise_before_n = 0;
  for (int ms = 1; ms <= 800; ++ms) {
    SafetyInput input = good_input(Vec3(0, 0, 3 + 0.005 * std::min(ms, 300)));
    input.state_age = std::chrono::milliseconds(ms < GetParam() ? ms : 0);
    rig.tick(input);
    const double rise_n = rig.out.f.z() - before_n;
    steepest_n = std::max(steepest_n, std::abs(rise_n));
    sharpest_n = std::max(sharpest_n, std::abs(rise_n - rise_before_n));
    most_missing_n = std::max(most_missing_n, input.wrench.f.z() - rig.out.f.z());
    before_n = rig.out.f.z();
    rise_before_n = rise_n;
  }
  EXPECT_GT(most_missing_n, 0.1) << "it decayed";
  EXPECT_LT(steepest_n, 0.23) << "4 N · 1.9 / 33 ms";
  EXPECT_LT(sharpest_n, 0.15);
  EXPECT_NEAR(rig.out.f.z(), 4.5, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Safety, ShortSilence, testing::Values(125, 132, 139, 146));

TEST(Safety, AStateAgainIsNoStepHoweverStrongTheForceIs) {
  for (const int silent_ms : {125, 132, 139, 146}) {
    SafetyRig rig;
    rig.run(good_input(Vec3(0, 0, 9)), 600);
    double steepest_n = 0, least_n = 9, before_n = 9;
    for (int ms = 1; ms <= 800; ++ms) {
      SafetyInput input = good_input(Vec3(0, 0, 9));
      input.state_age = std::chrono::milliseconds(ms < silent_ms ? ms : 0);
      rig.tick(input);
      if (ms >= silent_ms) steepest_n = std::max(steepest_n, std::abs(rig.out.f.z() - before_n));
      before_n = rig.out.f.z();
      least_n = std::min(least_n, before_n);
    }
    EXPECT_LT(least_n, 8.9) << "it decayed";
    EXPECT_LE(steepest_n, 0.27) << silent_ms;
    EXPECT_NEAR(rig.out.f.z(), 9, 1e-3);
  }
}

TEST(Safety, TheForceAfterASilenceReturnsSlowly) {
  SafetyRig rig;
  rig.run(good_input(Vec3(0, 0, 1)), 600);
  SafetyInput silent = good_input(Vec3(0, 0, 1));
  silent.state_age = std::chrono::milliseconds(118);
  rig.tick(silent);
  double steepest_n = 0, before_n = rig.out.f.z();
  for (int ms = 0; ms < 100; ++ms) {
    rig.tick(good_input(Vec3(0, 0, ms % 50 < 25 ? 8 : 2)));
    steepest_n = std::max(steepest_n, rig.out.f.z() - before_n);
    before_n = rig.out.f.z();
  }
  EXPECT_GT(steepest_n, 0.2);
  EXPECT_LE(steepest_n, 0.28 + 1e-9);
  rig.run(good_input(Vec3(0, 0, 2)), 600);
  rig.tick(good_input(Vec3(0, 0, 5)));
  EXPECT_NEAR(rig.out.f.z(), 5, 1e-9) << "as ever after half a second";
}

TEST(Safety, ContactThatEndsInASilenceNeitherPullsNorStays) {
  for (const int silent_ms : {120, 130, 140}) {
    SafetyRig rig;
    rig.run(good_input(), 600);
    for (int ms = 1; ms <= 300; ++ms) {
      SafetyInput input = good_input(Vec3(0, 0, ms < silent_ms ? 3 + 0.02 * ms : 0));
      input.state_age = std::chrono::milliseconds(ms < silent_ms ? ms : 0);
      rig.tick(input);
      EXPECT_GE(rig.out.f.z(), 0) << ms;
      if (ms <= silent_ms + 15) continue;
      EXPECT_EQ(rig.out.f.z(), 0) << "the slew limit alone holds it, " << ms;
    }
  }
}

TEST(Safety, EachFaultReachesZeroWithinTwentyMillisecondsAndStaysNamedUntilThen) {
  struct Case {
    SafetyFault fault;
    SafetyInput input;
  };
  std::vector<Case> cases{{kSafetyTooFast, good_input()},
                          {kSafetyInvalidSample, good_input()},
                          {kSafetyNotFinite, good_input()},
                          {kSafetyNotFinite, good_input()}};
  cases[0].input.handle_speed_m_per_s = 3.1;
  cases[1].input.sample_is_valid = false;
  cases[2].input.wrench.f.y() = std::numeric_limits<double>::quiet_NaN();
  cases[3].input.wrench.t.x() = 1e300;
  for (const SafetySettings& settings : {SafetySettings{}, slow_slew()}) {
    for (const Case& one : cases) {
      SafetyRig rig(settings);
      rig.run(good_input(), 5000);
      rig.tick(one.input);  // one invalid tick
      EXPECT_LT(rig.out.f.norm(), 3.0);
      EXPECT_TRUE(rig.chain.faults() & one.fault);
      EXPECT_LE(1 + rig.ticks_until_zero(good_input(), 100), 20) << describe_safety_faults(one.fault);
      EXPECT_TRUE(rig.chain.faults() & one.fault);
      rig.run(good_input(), 100);
      EXPECT_GT(rig.out.f.norm(), 0.0) << "re-armed";
      EXPECT_LE(rig.out.f.norm(), 0.61) << "by the ramp: 3 N · 0.1 s / 0.5 s";
      EXPECT_FALSE(rig.chain.faults() & one.fault);
    }
  }
}

TEST(Safety, LastingFaultKeepsZero) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  SafetyInput lost = good_input();
  lost.sample_is_valid = false;
  rig.run(lost, 20);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(rig.tick(lost).f.isZero(0));
}

TEST(Safety, NotANumberAsSpeedCountsAsTooFast) {
  SafetyRig rig;
  SafetyInput input = good_input();
  input.handle_speed_m_per_s = std::numeric_limits<double>::quiet_NaN();
  rig.tick(input);
  EXPECT_TRUE(rig.chain.faults() & kSafetyTooFast);
}

TEST(Safety, ShutdownIsQuietWithinTwentyMillisecondsForGood) {
  for (const SafetySettings& settings : {SafetySettings{}, slow_slew()}) {
    SafetyRig rig(settings);
    rig.run(good_input(), 5000);
    EXPECT_FALSE(rig.chain.is_quiet());
    rig.chain.begin_shutdown();
    EXPECT_LE(rig.ticks_until_zero(good_input(), 100), 20);
    EXPECT_TRUE(rig.chain.is_quiet());
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(rig.tick(good_input()).f.isZero(0));
  }
}

TEST(Safety, RearmingPassesThroughZeroWithoutAStep) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  rig.chain.rearm();
  rig.tick(good_input());
  EXPECT_NEAR(rig.out.f.z(), 3.0 * (1 - 1.0 / 15.0), 1e-9);
  EXPECT_LE(rig.ticks_until_zero(good_input(), 100), 20);
  rig.run(good_input(), 250);
  EXPECT_NEAR(rig.out.f.z(), 1.5, 0.01);
}

TEST(Safety, ClutchFadesTheForceThatWasDisplayedWhateverIsComputedAndEvenIfItBounces) {
  for (const int pressed_ticks : {1, 5, 1000}) {
    SafetyRig rig;
    rig.run(good_input(), 600);
    for (int i = 1; i <= 1000 + pressed_ticks; ++i) {
      // The requested force reverses abruptly, like the force of a damper when its velocity jumps.
      SafetyInput input = good_input(Vec3(0, 0, -5));
      input.is_clutched = i <= pressed_ticks;
      const double before_n = rig.out.f.z();
      rig.tick(input);
      // The displayed force of 3 N must fade by at most 0.1 N per millisecond.
      ASSERT_LE(std::abs(rig.out.f.z() - before_n), 0.1 + kSafetyRounding) << i << " ms, of " << pressed_ticks;
      ASSERT_TRUE(i > 30 || rig.out.f.z() >= 0) << i << " ms, of " << pressed_ticks;
      ASSERT_TRUE(i < 35 || i > pressed_ticks || rig.out.f.isZero(0));
      const bool is_named = (rig.chain.faults() & kSafetyClutched) != 0;
      ASSERT_TRUE(is_named || i > std::max(pressed_ticks, 29)) << i << " ms, of " << pressed_ticks;
      ASSERT_TRUE(!is_named || i <= std::max(pressed_ticks, 35)) << i << " ms, of " << pressed_ticks;
    }
    EXPECT_NEAR(rig.out.f.z(), -5, 1e-9) << "ramped in";
  }
}

TEST(Safety, AFaultUnderTheClutchIsNotReleasedSlowly) {
  SafetyRig rig;
  rig.run(good_input(Vec3(0, 0, 7)), 600);
  SafetyInput input = good_input(Vec3(0, 0, 7));
  input.is_clutched = true;
  rig.tick(input);
  input.handle_speed_m_per_s = 10;
  EXPECT_LE(rig.ticks_until_zero(input, 100), 20);
}

TEST(Safety, FaultIsNotOverBeforeTheDeviceHasTakenAZero) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  rig.chain.rearm();
  const Wrench stuck = rig.out;
  for (int i = 0; i < 1000; ++i) {
    rig.tick(good_input());
    rig.chain.set_displayed(stuck);
  }
  EXPECT_TRUE(rig.out.f.isZero(0)) << "the gain must not rise while the device displays a stuck force";
  rig.tick(good_input());
  EXPECT_TRUE(rig.out.f.isZero(0)) << "taken";
  rig.run(good_input(), 250);
  EXPECT_NEAR(rig.out.f.z(), 1.5, 1e-9) << "ramped in";
}

/// A stall of the loop, followed by regular ticks. The first parameter is the duration of the stall [ms]. The second
/// one is true if no state arrived during the stall, so that the last state is old.
class Stall : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(Stall, ReleasesTheForceInStepsThenRampsItIn) {
  const auto [stall_ms, state_is_old] = GetParam();
  SafetyRig rig;
  rig.run(good_input(Vec3(0, 0, 6)), 600);
  rig.now += std::chrono::milliseconds(stall_ms);
  double before_n = rig.out.f.z(), rose_n = 0;
  int zero_at = 0;
  for (int k = 1; k <= 600; ++k) {
    // After a stall, the computed force may have any value. The test uses 30 N for the first ticks.
    SafetyInput input = good_input(Vec3(0, 0, k < 20 ? 30 : 6));
    if (state_is_old && k < 30) input.state_age = std::chrono::milliseconds(stall_ms + k);
    rig.tick(input);
    const bool is_named = (rig.chain.faults() & kSafetyLate) != 0;
    EXPECT_TRUE(k > 15 || is_named) << k;
    EXPECT_FALSE(k > 18 && is_named) << k;
    ASSERT_LE(std::abs(rig.out.f.z() - before_n), 4 + kSafetyRounding) << k;
    ASSERT_TRUE(zero_at > 0 || rig.out.f.z() <= before_n) << "it rises before it was zero, tick " << k;
    if (zero_at == 0 && rig.out.f.isZero(0)) zero_at = k;
    if (zero_at > 0) rose_n = std::max(rose_n, rig.out.f.z() - before_n);
    before_n = rig.out.f.z();
  }
  EXPECT_GT(zero_at, 1);
  EXPECT_LE(zero_at, 20);
  EXPECT_LE(rose_n, 0.1) << "the start ramp: 6 N in 0.5 s";
  EXPECT_NEAR(rig.out.f.z(), 6, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Safety, Stall, testing::Combine(testing::Values(22, 70, 200, 500, 100000), testing::Bool()));

TEST(Safety, ASlightlyLateTickHasNoEffect) {
  SafetyRig rig;
  rig.run(good_input(), 600);
  rig.now += std::chrono::milliseconds(19);
  rig.tick(good_input());
  EXPECT_EQ(rig.chain.faults(), 0U);
  EXPECT_EQ(rig.out.f.z(), 3);
  rig.now += std::chrono::milliseconds(19);
  EXPECT_LE(rig.tick(good_input(Vec3(0, 0, 30))).f.z(), 3 + 4 + kSafetyRounding)
      << "slew counts a tick, whatever the gap";
}

TEST(Safety, ClampedForceDoesNotWindUp) {
  SafetySettings settings;
  settings.slew_n_per_s = 1000;
  SafetyRig rig(settings);
  for (int i = 0; i < 2000; ++i) {
    rig.tick(good_input(Vec3(0, 0, 100)));
    rig.chain.set_displayed({clamped_to_length(rig.out.f, 5.0), Vec3::Zero()});
  }
  rig.tick(good_input(Vec3::Zero()));
  EXPECT_NEAR(rig.out.f.z(), 4.0, kSafetyRounding)
      << "one slew step below the displayed 5 N, not below the computed 100 N";
}

TEST(Safety, SettingsThatBreakAPromiseAreRefused) {
  SafetySettings late;
  late.silence_zero = std::chrono::milliseconds(151);
  EXPECT_THROW(SafetyChain{late}, std::invalid_argument);
  SafetySettings slow;
  slow.fault_decay = std::chrono::milliseconds(21);
  EXPECT_THROW(SafetyChain{slow}, std::invalid_argument);
  SafetySettings no_slew;
  no_slew.slew_n_per_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SafetyChain{no_slew}, std::invalid_argument);
}

TEST(Safety, FaultsAreDescribedByWord) {
  EXPECT_EQ(describe_safety_faults(0), "none");
  EXPECT_EQ(describe_safety_faults(kSafetyRamping | kSafetyStopping), "ramping|stopping");
  EXPECT_EQ(describe_safety_faults(kSafetyClutched), "clutched");
}

}  // namespace
}  // namespace tandem::haptics
