// Tests OwnDevice, which an embedding program drives, together with the safety chain of a client and a virtual clock.
#include "client/embed/own_device.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "client/haptics/force_output.hpp"
#include "devices/device_reader.hpp"

namespace tandem::client::embed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr double kForce_n = 1.5;

devices::DeviceProfile profile() {
  devices::DeviceProfile profile;
  profile.spec.name = "test";
  return profile;
}

haptics::SafetySettings safety() {
  haptics::SafetySettings settings;
  settings.fault_decay = kFeedDecay;
  return settings;
}

/// A scene that pushes the hand with kForce_n, and a program that supplies the pose and reads the force once a
/// millisecond.
class Pressing {
 public:
  void feed(LocalTime at) {
    FedSample sample;
    sample.X_DH.p.x() = 0.01;
    device.feed(at, sample);
    fed = at;
  }
  void tick(LocalTime at) {
    const devices::DeviceSample sample = reader.read(at);
    haptics::SafetyInput conditions;
    conditions.has_state = true;
    conditions.sample_is_valid = sample.is_valid;
    output.write(at, {{kForce_n, 0, 0}, Vec3::Zero()}, Vec3::Zero(), conditions,
                 sample.state == devices::DeviceState::kReady);
  }
  double force_n(LocalTime at) { return device.force(at).on_hand_D.f.norm(); }
  /// Runs until the start ramp has ended.
  void press() {
    for (int i = 0; i < 1000; ++i) {
      now += milliseconds(1);
      feed(now);
      tick(now + microseconds(300));
    }
    ASSERT_DOUBLE_EQ(force_n(now + microseconds(300)), kForce_n);
  }

  OwnDevice device{profile()};
  devices::DeviceReader reader{device};
  ForceOutput output{safety(), device};
  LocalTime now{std::chrono::seconds(100)};
  LocalTime fed{};
};

TEST(OwnDevice, GivesZero20MsAfterTheFeedHasStalledWithoutAStep) {
  for (int phase_us = 0; phase_us < 1000; phase_us += 100) {
    SCOPED_TRACE(phase_us);
    Pressing hand;
    hand.press();
    double before = kForce_n;
    for (LocalTime now = hand.now + microseconds(1000 + phase_us); now < hand.fed + milliseconds(40);
         now += milliseconds(1)) {
      hand.tick(now);
      const double force_n = hand.force_n(now);
      EXPECT_LE(force_n, before);
      EXPECT_LE(before - force_n, 1.05 * kForce_n / 8) << "falls within 8 ms, evenly";
      before = force_n;
      const Duration age = now - hand.fed;
      if (age < kMaxFeedAge) {
        EXPECT_DOUBLE_EQ(force_n, kForce_n);
      } else if (age >= kZeroWithin) {
        EXPECT_EQ(hand.output.displayed_D().f.norm(), 0) << "by the safety chain";
        EXPECT_EQ(force_n, 0);
      }
    }
  }
}

TEST(OwnDevice, ForceReturnsByTheRampWhenTheFeedReturns) {
  Pressing hand;
  hand.press();
  for (int i = 0; i < 60; ++i) hand.tick(hand.now += milliseconds(1));
  double before = 0, after_half_ramp = 0;
  for (int i = 0; i < 700; ++i) {
    hand.now += milliseconds(1);
    hand.feed(hand.now);
    hand.tick(hand.now + microseconds(300));
    const double force_n = hand.force_n(hand.now + microseconds(300));
    EXPECT_LE(force_n - before, 0.02);
    before = force_n;
    if (i == 250) after_half_ramp = force_n;
  }
  EXPECT_NEAR(after_half_ramp, kForce_n / 2, 0.1 * kForce_n);
  EXPECT_DOUBLE_EQ(before, kForce_n);
}

TEST(OwnDevice, ProgramReadsZeroIfTheLoopStallsUntilTheLoopHasRestartedFromZero) {
  Pressing hand;
  hand.press();
  const LocalTime ticked = hand.now + microseconds(300);
  for (int i = 1; i <= 30; ++i) hand.feed(hand.now += milliseconds(1));
  EXPECT_EQ(hand.force_n(hand.now), 0);
  EXPECT_TRUE(hand.device.force(hand.now).is_stale);
  EXPECT_GT(hand.now - ticked, kZeroWithin);
  for (int i = 0; i < 20; ++i) {
    hand.feed(hand.now += milliseconds(1));
    hand.tick(hand.now);
    EXPECT_LE(hand.force_n(hand.now), 0.01 * (i + 1)) << i;
  }
}

TEST(OwnDevice, IsOnUntilTheProgramHasReadZero) {
  Pressing hand;
  hand.press();
  EXPECT_TRUE(hand.device.may_be_on());
  hand.now += milliseconds(1);
  EXPECT_FALSE(hand.output.write_zero(hand.now)) << "the program still displays the force";
  EXPECT_EQ(hand.force_n(hand.now), 0);
  EXPECT_TRUE(hand.output.write_zero(hand.now));
}

TEST(OwnDevice, IsInvalidBeforeTheFirstSampleAndAfterTheFeedHasEnded) {
  Pressing hand;
  EXPECT_FALSE(hand.device.read(hand.now).is_valid);
  EXPECT_EQ(hand.device.read(hand.now).state, devices::DeviceState::kOpening);
  hand.feed(hand.now);
  EXPECT_TRUE(hand.device.read(hand.now).is_valid);
  hand.device.end_feed();
  EXPECT_FALSE(hand.device.read(hand.now).is_valid);
  EXPECT_EQ(hand.device.read(hand.now).state, devices::DeviceState::kLost);
}

TEST(OwnDevice, EstimatesAVelocityThatTheProgramOmits) {
  Pressing hand;
  FedSample sample;
  for (int i = 0; i < 50; ++i) {
    hand.now += milliseconds(1);
    sample.X_DH.p.y() += 0.0002;
    hand.device.feed(hand.now, sample);
  }
  EXPECT_NEAR(hand.device.read(hand.now).V_DH.v.y(), 0.2, 1e-6);
  sample.has_velocity = true;
  sample.V_DH.v = {0, 0, 0.7};
  hand.device.feed(hand.now += milliseconds(1), sample);
  EXPECT_EQ(hand.device.read(hand.now).V_DH.v, Vec3(0, 0, 0.7));
}

TEST(OwnDevice, SamplesThatNoHandCanProduceAreNamed) {
  FedSample good;
  EXPECT_STREQ(problem_of(good), "");
  FedSample bad = good;
  bad.X_DH.p.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_STRNE(problem_of(bad), "");
  bad = good;
  bad.X_DH.q.coeffs() *= 1.1;
  EXPECT_STRNE(problem_of(bad), "");
  bad = good;
  bad.V_DH.w.z() = std::numeric_limits<double>::infinity();
  EXPECT_STREQ(problem_of(bad), "") << "a velocity that is not fed is not used";
  bad.has_velocity = true;
  EXPECT_STRNE(problem_of(bad), "");
}

TEST(OwnDevice, ServesOneClientAtATime) {
  OwnDevice device(profile());
  EXPECT_TRUE(device.reserve());
  EXPECT_FALSE(device.reserve());
  device.unreserve();
  EXPECT_TRUE(device.reserve());
}

}  // namespace
}  // namespace tandem::client::embed
