// Tests the force clamp of the writer. The clamp is the last stage and must be exact. Only a verified data sheet may
// raise its limits.
#include "devices/device_writer.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>

#include "common/base/random.hpp"

namespace tandem::devices {
namespace {

// Largest relative excess of a vector's length over its limit after clamped_to_length(). The function scales the vector
// twice, so two rounding errors may add up.
constexpr double kOneClampRounding = 4 * std::numeric_limits<double>::epsilon();

class RecordingDevice final : public Device {
 public:
  const DeviceSpec& spec() const noexcept override { return device_spec; }
  DeviceSample read(LocalTime) noexcept override { return {}; }
  bool write(LocalTime, const Wrench& wrench_on_hand_D) noexcept override {
    last = wrench_on_hand_D;
    return accepts;
  }

  DeviceSpec device_spec;
  Wrench last;
  bool accepts = true;
};

RecordingDevice verified_device() {
  RecordingDevice device;
  device.device_spec.name = "test";
  device.device_spec.actuated_rotations = 3;
  device.device_spec.force_maximum_n = {8.0, "a data sheet"};
  device.device_spec.torque_maximum_n_m = {0.5, "a data sheet"};
  device.device_spec.force_limit_n = 6.0;
  device.device_spec.torque_limit_n_m = 0.3;
  return device;
}

TEST(DeviceWriter, AForceWithinTheLimitsIsUnchanged) {
  RecordingDevice device = verified_device();
  DeviceWriter writer(device);
  const Wrench wrench{Vec3(1, -2, 3), Vec3(0.1, 0, -0.1)};
  EXPECT_TRUE(writer.write(LocalTime{}, wrench));
  EXPECT_EQ(device.last.f, wrench.f);
  EXPECT_EQ(device.last.t, wrench.t);
  EXPECT_FALSE(writer.was_clamped());
}

TEST(DeviceWriter, ADeviceWithoutForceReceivesNoneAndThatIsNotCountedAsClamped) {
  RecordingDevice device = verified_device();
  device.device_spec.actuated_translations = device.device_spec.actuated_rotations = 0;
  DeviceWriter writer(device);
  EXPECT_TRUE(writer.write(LocalTime{}, {Vec3(1, 0, 0), Vec3(0, 0.1, 0)}));
  EXPECT_TRUE(device.last.f.isZero(0));
  EXPECT_TRUE(device.last.t.isZero(0));
  EXPECT_FALSE(writer.was_clamped());
}

TEST(DeviceWriter, ClampsAnyWrenchToTheLimitsWithItsDirectionKept) {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : 4711;
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  RecordingDevice device = verified_device();
  DeviceWriter writer(device);
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::pow(10.0, random.uniform(-3, 300));
    const Wrench wrench{scale * Vec3(random.normal(), random.normal(), random.normal()),
                        scale * Vec3(random.normal(), random.normal(), random.normal())};
    writer.write(LocalTime{}, wrench);
    ASSERT_LE(device.last.f.norm(), 6.0 * (1 + kOneClampRounding));
    ASSERT_LE(device.last.t.norm(), 0.3 * (1 + kOneClampRounding));
    const double largest = wrench.f.cwiseAbs().maxCoeff();
    ASSERT_GT(device.last.f.normalized().dot((wrench.f / largest).normalized()), 1 - 1e-12);
  }
}

TEST(DeviceWriter, WritesZeroForAnythingNotFinite) {
  RecordingDevice device = verified_device();
  DeviceWriter writer(device);
  writer.write(LocalTime{}, {Vec3(0, std::numeric_limits<double>::infinity(), 0), Vec3(0.1, 0, 0)});
  EXPECT_TRUE(device.last.f.isZero(0));
  EXPECT_TRUE(device.last.t.isZero(0));
  EXPECT_TRUE(writer.was_clamped());
}

TEST(DeviceWriter, ReportsACommandThatTheDeviceRefused) {
  RecordingDevice device = verified_device();
  DeviceWriter writer(device);
  writer.write(LocalTime{}, {Vec3(0, 0, 2), Vec3(0, 0.1, 0)});
  device.accepts = false;
  EXPECT_FALSE(writer.write_zero(LocalTime{}));
  EXPECT_EQ(writer.written().f, Vec3(0, 0, 2)) << "the last accepted force still acts";
  EXPECT_EQ(writer.written().t, Vec3(0, 0.1, 0));
  device.accepts = true;
  EXPECT_TRUE(writer.write_zero(LocalTime{}));
  EXPECT_TRUE(writer.written().f.isZero(0));
}

TEST(DeviceWriter, ShowsNoTorqueOnADeviceOfThreeAxes) {
  RecordingDevice device = verified_device();
  device.device_spec.actuated_rotations = 0;
  DeviceWriter writer(device);
  writer.write(LocalTime{}, {Vec3(1, 0, 0), Vec3(0.1, 0, 0)});
  EXPECT_TRUE(device.last.t.isZero(0));
  EXPECT_FALSE(writer.was_clamped());
}

TEST(DeviceWriter, LimitsOfTheSpecAreCopiedOnceAndCannotBeRaisedLater) {
  RecordingDevice device = verified_device();
  DeviceWriter writer(device);
  device.device_spec.force_limit_n = 100;
  writer.write(LocalTime{}, {Vec3(50, 0, 0), Vec3::Zero()});
  EXPECT_DOUBLE_EQ(device.last.f.x(), 6.0);
}

void expect_refused(const DeviceSpec& spec, const std::string& field) {
  RecordingDevice device;
  device.device_spec = spec;
  try {
    DeviceWriter writer(device);
    FAIL() << field << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
  }
}

TEST(DeviceWriter, RefusesLimitsAboveAVerifiedMaximum) {
  DeviceSpec spec = verified_device().device_spec;
  spec.force_limit_n = 8.1;
  expect_refused(spec, "force_limit_n");
  spec = verified_device().device_spec;
  spec.torque_limit_n_m = 0.6;
  expect_refused(spec, "torque_limit_n_m");
}

TEST(DeviceWriter, UnverifiedMaximumMayDescribeButNotLimit) {
  for (const std::string source : {"", "unverified"}) {
    DeviceSpec spec = verified_device().device_spec;
    spec.force_maximum_n = {8.0, source};
    expect_refused(spec, "force_limit_n");
    spec = verified_device().device_spec;
    spec.torque_maximum_n_m = {0.5, source};
    expect_refused(spec, "torque_limit_n_m");
    RecordingDevice device;
    device.device_spec.force_maximum_n = {8.0, source};
    EXPECT_NO_THROW(DeviceWriter{device}) << "2 N and 0.1 N·m, the defaults, are allowed";
  }
}

TEST(DeviceWriter, RefusesLimitsThatAreNoNumbersOrNegative) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1.0}) {
    DeviceSpec spec = verified_device().device_spec;
    spec.force_limit_n = bad;
    expect_refused(spec, "force_limit_n");
    spec = verified_device().device_spec;
    spec.slew_limit_n_per_s = bad;
    expect_refused(spec, "slew_limit_n_per_s");
    spec = verified_device().device_spec;
    spec.speed_limit_m_per_s = bad;
    expect_refused(spec, "speed_limit_m_per_s");
  }
}

}  // namespace
}  // namespace tandem::devices
