// Tests which device samples the reader accepts, and which it reports as faults.
#include "devices/device_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <numbers>
#include <string>

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A device that returns the sample set by the test. Its time stamp is the time of the read minus `age`.
class SpokenDevice final : public Device {
 public:
  SpokenDevice() {
    sample.state = DeviceState::kReady;
    sample.is_valid = true;
    device_spec.reach_m = 0.3;
  }
  const DeviceSpec& spec() const noexcept override { return device_spec; }
  DeviceSample read(LocalTime now) noexcept override {
    DeviceSample given = sample;
    given.taken = now - age;
    return given;
  }
  bool write(LocalTime, const Wrench&) noexcept override { return true; }

  DeviceSpec device_spec;
  DeviceSample sample;
  Duration age{0};
};

struct Rig {
  DeviceSample read() { return reader.read(now += milliseconds(1)); }

  SpokenDevice device;
  DeviceReader reader{device};
  LocalTime now{std::chrono::hours(1)};
};

std::string fault_of(Rig& rig) {
  const DeviceSample sample = rig.read();
  EXPECT_EQ(sample.is_valid, sample.reason.empty());
  return std::string(sample.reason);
}

TEST(DeviceReader, PassesAHandThatMovesAsHandsDo) {
  Rig rig;
  for (int i = 0; i < 1000; ++i) {
    const double t_s = 1e-3 * i;
    rig.device.sample.X_DH.p = Vec3(0.1 * std::sin(20 * t_s), 0.05, 0);  // speed of up to 2 m/s
    rig.device.sample.X_DH.q = quaternion_of(Vec3(0, 0, 1.5 * std::sin(15 * t_s)));
    rig.device.sample.V_DH.v = Vec3(2 * std::cos(20 * t_s), 0, 0);
    ASSERT_EQ(fault_of(rig), "") << i;
  }
}

TEST(DeviceReader, NotANumberIsAFault) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    Rig rig;
    rig.device.sample.X_DH.p.y() = bad;
    EXPECT_THAT(fault_of(rig), HasSubstr("not a number"));
    Rig spinning;
    spinning.device.sample.V_DH.w.y() = bad;
    EXPECT_THAT(fault_of(spinning), HasSubstr("not a number"));
  }
}

TEST(DeviceReader, ATimeStampOutOfTwentyMillisecondsIsAFault) {
  for (const int age_ms : {-20, 0, 20}) {
    Rig rig;
    rig.device.age = milliseconds(age_ms);
    EXPECT_EQ(fault_of(rig), "") << age_ms;
  }
  for (const int age_ms : {-3600'000, -21, 21, 3600'000}) {
    Rig rig;
    rig.device.age = milliseconds(age_ms);
    EXPECT_THAT(fault_of(rig), HasSubstr("time stamp")) << age_ms;
  }
}

TEST(DeviceReader, AQuaternionThatIsNoRotationIsAFault) {
  for (const double length : {0.0, 0.998, 1.002, 1e200}) {
    Rig rig;
    rig.device.sample.X_DH.q.coeffs() *= length;
    EXPECT_THAT(fault_of(rig), HasSubstr("no rotation")) << length;
  }
  Rig rig;
  rig.device.sample.X_DH.q.coeffs() *= 1.0005;
  EXPECT_EQ(fault_of(rig), "");
}

TEST(DeviceReader, APlaceThatTheDeviceCannotReachIsAFault) {
  for (const double x_m : {0.31, -0.31, 1e12, 1e300}) {
    Rig rig;
    rig.device.sample.X_DH.p.x() = x_m;
    EXPECT_THAT(fault_of(rig), HasSubstr("workspace_m")) << x_m;
  }
}

TEST(DeviceReader, SpeedOfThreeTimesTheLimitIsAFaultAndLessIsTheSafetyChains) {
  Rig rig;
  rig.device.sample.V_DH.v.z() = 8.9;  // above the limit of 3 m/s
  EXPECT_EQ(fault_of(rig), "");
  rig.device.sample.V_DH.v.z() = 9.1;
  EXPECT_THAT(fault_of(rig), HasSubstr("faster than any hand"));
  rig.device.sample.V_DH.v.z() = 1e200;
  EXPECT_THAT(fault_of(rig), HasSubstr("faster than any hand"));
  rig.device.sample.V_DH = {};
  rig.device.sample.V_DH.w.z() = 301;
  EXPECT_THAT(fault_of(rig), HasSubstr("faster than any hand"));
}

TEST(DeviceReader, AJumpIsAFaultThereAndBackAndNotForEver) {
  Rig rig;
  EXPECT_EQ(fault_of(rig), "");
  rig.device.sample.X_DH.p.x() = 0.02;
  EXPECT_THAT(fault_of(rig), HasSubstr("jumps"));
  EXPECT_EQ(fault_of(rig), "") << "it stays there";
  rig.device.sample.X_DH.q = quaternion_of(Vec3(0, 0, 0.5 * std::numbers::pi));
  EXPECT_THAT(fault_of(rig), HasSubstr("jumps"));
  EXPECT_EQ(fault_of(rig), "");
  rig.device.sample.X_DH.q.coeffs() *= -1;
  EXPECT_EQ(fault_of(rig), "") << "the same rotation";
}

TEST(DeviceReader, WhereTheHandIsAfterTheDeviceWasAwayIsNoJump) {
  Rig rig;
  rig.read();
  rig.device.sample.state = DeviceState::kLost;
  rig.device.sample.reason = "it was unplugged";
  const DeviceSample lost = rig.read();
  EXPECT_FALSE(lost.is_valid);
  EXPECT_EQ(lost.reason, "it was unplugged") << "the device's own words";
  rig.device.sample.state = DeviceState::kReady;
  rig.device.sample.reason = {};
  rig.device.sample.X_DH.p.x() = 0.2;
  EXPECT_EQ(fault_of(rig), "");
}

TEST(DeviceReader, AButtonThatTheDeviceDoesNotHaveIsNoise) {
  Rig rig;
  rig.device.device_spec.buttons = kButtonGrab;
  rig.device.sample.buttons = kButtonGrab | kButtonClutch;
  EXPECT_EQ(rig.read().buttons, kButtonGrab);
}

}  // namespace
}  // namespace tandem::devices
