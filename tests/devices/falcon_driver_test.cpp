// Tests the driver of the Falcon against a simulator of its protocol: opening, firmware, homing, a session, and faults.
#include "devices/falcon/falcon_driver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>
#include <string>

#include "common/base/buttons.hpp"
#include "devices/device_profile.hpp"
#include "devices/device_reader.hpp"
#include "devices/device_writer.hpp"
#include "tests/devices/falcon_simulator.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::size_t kFirmwareSize = 7914;

class SimulatedPort final : public FalconPort {
 public:
  explicit SimulatedPort(FalconSimulator& falcon) : falcon_(falcon) {}
  bool control(FtdiRequest request, std::uint16_t value) override {
    return falcon_.control(static_cast<std::uint8_t>(request), value);
  }
  bool write(std::span<const std::uint8_t> bytes) override { return falcon_.write(bytes); }
  bool is_written() const override { return true; }
  int read(std::span<std::uint8_t> bytes, Duration longest) override {
    // The USB bridge delivers one packet per millisecond.
    for (Duration waited{0}; waited <= longest; waited += milliseconds(1)) {
      const auto packet = falcon_.read();
      if (!packet) return -1;
      if (packet->size() == 2) continue;
      std::copy(packet->begin() + 2, packet->end(), bytes.begin());
      return static_cast<int>(packet->size()) - 2;
    }
    return 0;
  }

 private:
  FalconSimulator& falcon_;
};

std::vector<std::uint8_t> firmware() {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < kFirmwareSize; ++i) bytes.push_back(static_cast<std::uint8_t>(i * 31 + i / 256));
  return bytes;
}

FalconSettings settings(bool has_firmware = true) {
  const DeviceProfile profile = find_device_profile("falcon");
  FalconSettings result{profile.spec, has_firmware ? firmware() : std::vector<std::uint8_t>{}, 10000};
  result.spec.position_step_m = profile.position_step_m.value;
  return result;
}

OpenFalcon opener(FalconSimulator& falcon) {
  return [&falcon](std::string_view& reason) -> std::unique_ptr<FalconPort> {
    if (!falcon.faults.is_unplugged) return std::make_unique<SimulatedPort>(falcon);
    reason = "no Falcon is plugged in";
    return nullptr;
  };
}

struct Rig {
  explicit Rig(bool has_firmware = true)
      : driver(settings(has_firmware), opener(falcon), std::make_unique<SimulatedPort>(falcon)) {}

  DeviceSample step(const Wrench& wrench = {}) { return driver.step(now += milliseconds(1), wrench); }
  DeviceSample run(int steps, const Wrench& wrench = {}) {
    DeviceSample sample;
    for (int i = 0; i < steps; ++i) sample = step(wrench);
    return sample;
  }
  /// Runs steps until the device is in `state`, at most `most` steps. Returns the last sample.
  DeviceSample until(DeviceState state, int most) {
    DeviceSample sample = step();
    for (int i = 0; i < most && sample.state != state; ++i) sample = step();
    EXPECT_EQ(sample.state, state) << sample.reason;
    return sample;
  }
  /// Brings the device to the ready state: firmware loaded, homed, and grip at the centre.
  void make_ready() {
    falcon.has_firmware = falcon.is_homed = true;
    until(DeviceState::kReady, 100);
    run(5);
  }

  /// Homes the device by moving the grip inwards and out again.
  DeviceSample home() {
    falcon.grip_m = Vec3(0, 0, 0.078);
    run(3);
    falcon.grip_m = Vec3(0, 0, 0.175);
    return until(DeviceState::kReady, 10);
  }

  FalconSimulator falcon{kFirmwareSize};
  FalconDriver driver;
  LocalTime now{seconds(100)};
};

/// Returns the force of the motors on the hand in the frame D.
Vec3 shown_force(const FalconSimulator& falcon) {
  const Vec3 f = falcon_jacobian(falcon.grip_m)->transpose() * (falcon.motors.cast<double>() / -10000.0);
  return {f.x(), -f.z(), f.y()};
}

TEST(FalconDriver, LoadsTheFirmwareHomesAndIsReadyWhereTheGripIs) {
  Rig rig;
  rig.falcon.faults.greetings_ignored = 7;
  DeviceSample sample = rig.until(DeviceState::kHoming, 1000);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("push it straight in"));
  EXPECT_EQ(rig.falcon.uploaded, firmware());
  EXPECT_EQ(rig.falcon.lights_and_home, kFalconRed | kFalconHome);
  sample = rig.run(200, {Vec3(0, 0, 5), Vec3::Zero()});
  EXPECT_TRUE(rig.falcon.motors.isZero()) << "no force before it is homed";
  rig.home();
  rig.falcon.grip_m = Vec3(0.01, 0.02, 0.12);
  sample = rig.run(50);
  EXPECT_TRUE(sample.is_valid);
  EXPECT_NEAR((sample.X_DH.p - Vec3(0.01, 0.005, 0.02)).norm(), 0, 6e-5) << "x right, y away from the user, z up";
  EXPECT_EQ(sample.taken, rig.now);
  EXPECT_EQ(rig.falcon.lights_and_home, kFalconGreen | kFalconHome);
}

TEST(FalconDriver, HomedItIsBlueAndWithoutForceUntilItIsPulledOut) {
  Rig rig;
  rig.falcon.has_firmware = true;
  rig.until(DeviceState::kHoming, 50);
  rig.falcon.grip_m = Vec3(0, 0, 0.078);
  rig.run(3);
  EXPECT_EQ(rig.falcon.lights_and_home, kFalconBlue | kFalconHome);
  rig.falcon.grip_m = Vec3(0, 0, 0.169);
  DeviceSample sample = rig.run(100, {Vec3(0, 0, 5), Vec3::Zero()});
  EXPECT_EQ(sample.state, DeviceState::kHoming);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("pull its grip out"));
  EXPECT_TRUE(rig.falcon.motors.isZero());
  rig.falcon.grip_m = Vec3(0, 0, 0.171);
  sample = rig.run(3, {Vec3(0, 0, 5), Vec3::Zero()});
  EXPECT_EQ(sample.state, DeviceState::kReady);
  EXPECT_TRUE(sample.is_valid);
  EXPECT_EQ(rig.falcon.lights_and_home, kFalconGreen | kFalconHome);
  EXPECT_FALSE(rig.falcon.motors.isZero());
  rig.falcon.grip_m = Vec3(0, 0, 0.12);
  EXPECT_EQ(rig.run(3).state, DeviceState::kReady) << "once is enough";
}

TEST(FalconDriver, OneThatHasItsFirmwareNeedsNone) {
  Rig rig(false);
  rig.falcon.has_firmware = true;
  rig.until(DeviceState::kHoming, 50);
  EXPECT_EQ(rig.falcon.uploads_begun, 0);
}

TEST(FalconDriver, WithoutFirmwareItNamesTheRemedy) {
  Rig rig(false);
  const DeviceSample sample = rig.run(3000);
  EXPECT_EQ(sample.state, DeviceState::kOpening);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("--firmware"));
  rig.falcon.has_firmware = true;  // another program has loaded the firmware
  rig.until(DeviceState::kHoming, 2000);
}

TEST(FalconDriver, FirmwareThatFailsTwiceIsLoadedTheThirdTime) {
  Rig rig;
  rig.falcon.faults.uploads_corrupted = 2;
  rig.falcon.faults.greets_with_zero = true;
  rig.until(DeviceState::kHoming, 3000);
  EXPECT_EQ(rig.falcon.uploads_begun, 3);
  EXPECT_EQ(rig.falcon.uploaded, firmware());
}

TEST(FalconDriver, AFailedFirmwareUploadIsReportedAndRetriedWithPauses) {
  Rig rig;
  rig.falcon.faults.stops_in_upload = true;
  const DeviceSample sample = rig.run(60'000);
  EXPECT_EQ(sample.state, DeviceState::kOpening);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("could not be loaded"));
  EXPECT_GE(rig.falcon.uploads_begun, 10);
  EXPECT_LE(rig.falcon.uploads_begun, 25);
  rig.falcon.faults.stops_in_upload = false;
  rig.until(DeviceState::kHoming, 10'000);
}

TEST(FalconDriver, LongHomingIsReportedAndStillSucceeds) {
  Rig rig;
  rig.falcon.has_firmware = true;
  rig.until(DeviceState::kHoming, 100);
  DeviceSample sample = rig.run(61'000);
  EXPECT_EQ(sample.state, DeviceState::kLost);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("60 s"));
  EXPECT_EQ(rig.home().state, DeviceState::kReady);
}

TEST(FalconDriver, ForceIsTheCommandedOneInEveryDirection) {
  Rig rig;
  rig.make_ready();
  rig.falcon.grip_m = Vec3(0.01, -0.015, 0.13);
  rig.run(50);
  for (const Vec3& force : {Vec3(2, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, -2), Vec3(-1, 1, 1)}) {
    rig.run(2, {force, Vec3::Zero()});
    EXPECT_NEAR((shown_force(rig.falcon) - force).norm(), 0, 0.05) << force.transpose();
  }
  rig.run(2);
  EXPECT_TRUE(rig.falcon.motors.isZero());
}

TEST(FalconDriver, ButtonsAreGrabAndClutch) {
  Rig rig;
  rig.make_ready();
  rig.falcon.buttons = kFalconCentre;
  EXPECT_EQ(rig.run(2).buttons, kButtonGrab);
  for (const std::uint8_t other : {kFalconLeft, kFalconRight, kFalconForward}) {
    rig.falcon.buttons = other;
    EXPECT_EQ(rig.run(2).buttons, kButtonClutch);
  }
}

TEST(FalconDriver, GarbageAndSplitAndDelayedRepliesAreHandled) {
  Rig rig;
  rig.make_ready();
  rig.falcon.faults.sends_garbage = rig.falcon.faults.splits_replies = true;
  rig.falcon.faults.replies_delayed_by = 4;
  for (int i = 0; i < 300; ++i) {
    rig.falcon.grip_m.x() = 0.02 * std::sin(0.01 * i);
    const DeviceSample sample = rig.step({Vec3(0, 0, 1), Vec3::Zero()});
    ASSERT_TRUE(sample.is_valid) << i << ": " << describe(sample);
    ASSERT_EQ(sample.taken, rig.now);
    ASSERT_NEAR(sample.X_DH.p.x(), rig.falcon.grip_m.x(), 2e-4) << i;
  }
}

TEST(FalconDriver, ARepliesSilenceAgesAndThenItIsLost) {
  Rig rig;
  rig.make_ready();
  rig.falcon.faults.is_mute = true;
  const LocalTime last = rig.now;
  DeviceSample sample = rig.step();
  EXPECT_EQ(sample.taken, last) << "the reader compares this time with its limit";
  sample = rig.run(105);
  EXPECT_EQ(sample.state, DeviceState::kLost);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("cable"));
  rig.falcon.faults.is_mute = false;
  rig.until(DeviceState::kReady, 3000);
}

TEST(FalconDriver, UnpluggedItIsLostAndComesBackThroughFirmwareAndHoming) {
  Rig rig;
  rig.make_ready();
  rig.run(10, {Vec3(0, 0, 3), Vec3::Zero()});
  rig.falcon.faults.is_unplugged = true;
  DeviceSample sample = rig.step({Vec3(0, 0, 3), Vec3::Zero()});
  EXPECT_EQ(sample.state, DeviceState::kLost);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("plug it in again"));
  rig.run(2500);
  rig.falcon.cycle_power();
  rig.falcon.faults.is_unplugged = false;
  rig.until(DeviceState::kHoming, 4000);
  EXPECT_EQ(rig.falcon.uploads_begun, 1);
  rig.run(50, {Vec3(0, 0, 3), Vec3::Zero()});
  EXPECT_TRUE(rig.falcon.motors.isZero());
  rig.home();
}

TEST(FalconDriver, FrozenEncodersUnderAForceLetItGoUntilTheyMove) {
  Rig rig;
  rig.make_ready();
  rig.falcon.faults.has_frozen_encoders = true;
  DeviceSample sample = rig.run(2900, {Vec3(0, 0, 2), Vec3::Zero()});
  EXPECT_TRUE(sample.is_valid);
  EXPECT_FALSE(rig.falcon.motors.isZero());
  sample = rig.run(200, {Vec3(0, 0, 2), Vec3::Zero()});
  EXPECT_FALSE(sample.is_valid);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("do not move"));
  EXPECT_TRUE(rig.falcon.motors.isZero()) << "whatever the loop says";
  rig.run(10'000, {Vec3(0, 0, 2), Vec3::Zero()});
  EXPECT_TRUE(rig.falcon.motors.isZero());
  rig.falcon.faults.has_frozen_encoders = false;
  rig.falcon.grip_m.x() += 1e-3;
  EXPECT_TRUE(rig.run(2).is_valid);
  rig.make_ready();
  EXPECT_TRUE(rig.run(10'000).is_valid) << "without a force a hand may rest";
}

TEST(FalconDriver, EncodersOfNoPlaceGiveNoSampleAndNoForce) {
  Rig rig;
  rig.make_ready();
  rig.falcon.grip_m = Vec3(0, 0, 0.18);
  rig.run(10);
  rig.falcon.is_homed = false;  // a device that has lost its zero position must be homed again
  EXPECT_EQ(rig.step({Vec3(0, 0, 2), Vec3::Zero()}).state, DeviceState::kHoming);
  rig.step({Vec3(0, 0, 2), Vec3::Zero()});
  EXPECT_TRUE(rig.falcon.motors.isZero());
}

TEST(FalconDriver, OnItsThreadASessionRunsAndItsEndIsZero) {
  FalconSimulator falcon(kFirmwareSize);
  falcon.is_homed = true;
  {
    ThreadedDevice device(
        std::make_unique<FalconDriver>(settings(), opener(falcon), std::make_unique<SimulatedPort>(falcon)));
    DeviceReader reader(device);
    DeviceWriter writer(device);
    const SteadyClock clock;
    const LocalTime give_up = clock.now() + seconds(30);
    DeviceSample sample;
    int ready = 0;
    while (ready < 200 && clock.now() < give_up) {
      sample = reader.read(clock.now());
      writer.write(clock.now(), sample.is_valid ? Wrench{Vec3(0, 0, 2), Vec3::Zero()} : Wrench{});
      ready += sample.is_valid ? 1 : 0;
      std::this_thread::sleep_for(milliseconds(1));
    }
    EXPECT_EQ(ready, 200) << describe(sample);
  }
  EXPECT_TRUE(falcon.has_firmware);
  EXPECT_TRUE(falcon.motors.isZero()) << "the last command must be zero";
}

TEST(FalconDriverSettings, MotorCountsOutOfRangeAreRefused) {
  for (const double counts : {-1.0, 0.0, 99.0, 20001.0, std::numeric_limits<double>::quiet_NaN()}) {
    FalconSettings wrong = settings();
    wrong.motor_counts_per_n_m = counts;
    EXPECT_THROW(FalconDriver(wrong, {}, nullptr), std::invalid_argument) << counts;
  }
}

}  // namespace
}  // namespace tandem::devices
