// Tests the drivers of the vendor SDKs with a substitute library: calls, units, axes and refusals. The behaviour of the
// substitute follows the public documentation; it was not compared with hardware or a vendor's library.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>
#include <stdexcept>
#include <string>

#include "common/base/buttons.hpp"
#include "devices/forcedimension/force_dimension.hpp"
#include "devices/openhaptics/open_haptics.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Access to the variables of the substitute library.
class FakeSdk {
 public:
  FakeSdk() : handle_(dlopen(TANDEM_FAKE_SDK, RTLD_NOW)) {
    if (handle_ == nullptr) throw std::runtime_error(dlerror());
    number("fake_is_there") = 1;
    number("fake_refuses_watchdog") = number("fake_refuses_force") = 0;
    number("fake_buttons") = number("fake_is_open") = number("fake_has_force_on") = 0;
    turn(Quat::Identity());
    place(Vec3::Zero());
  }
  int& number(const char* name) { return *static_cast<int*>(dlsym(handle_, name)); }
  double* numbers(const char* name) { return static_cast<double*>(dlsym(handle_, name)); }
  void place(const Vec3& p) { Eigen::Map<Vec3>(numbers("fake_place")) = p; }
  void turn(const Quat& q) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers("fake_rows")) = q.toRotationMatrix();
  }
  Vec3 force() { return Eigen::Map<Vec3>(numbers("fake_force")); }
  Vec3 torque() { return Eigen::Map<Vec3>(numbers("fake_force") + 3); }

 private:
  void* handle_;
};

DeviceSpec spec() {
  DeviceSpec result = find_device_profile("omega.6").spec;
  result.actuated_rotations = 3;
  return result;
}

LocalTime at(int ms) {
  return LocalTime(std::chrono::seconds(100) + std::chrono::milliseconds(ms));
}

TEST(ForceDimension, IsReadInMetresAndFeelsNewtonsInItsOwnAxes) {
  FakeSdk sdk;
  ForceDimensionDriver driver(spec(), dhd_functions(TANDEM_FAKE_SDK));
  sdk.place(Vec3(0.01, 0.02, 0.03));  // components: towards the user, to the right, up
  sdk.turn(quaternion_of(Vec3(0, 0, 0.3)));
  sdk.number("fake_buttons") = 3;
  const DeviceSample sample = driver.step(at(0), {Vec3(1, 2, 3), Vec3(0.1, 0.2, 0.3)});
  ASSERT_TRUE(sample.is_valid);
  EXPECT_EQ(sample.state, DeviceState::kReady);
  EXPECT_NEAR((sample.X_DH.p - Vec3(0.02, -0.01, 0.03)).norm(), 0, 1e-12) << "right, away, up";
  EXPECT_NEAR((rotation_vector(sample.X_DH.q) - Vec3(0, 0, 0.3)).norm(), 0, 1e-9) << "up is up in both";
  EXPECT_EQ(sample.buttons, kButtonGrab | kButtonClutch);
  EXPECT_EQ(sdk.force(), Vec3(-2, 1, 3));
  EXPECT_EQ(sdk.torque(), Vec3(-0.2, 0.1, 0.3));
  EXPECT_EQ(sdk.number("fake_has_force_on"), 1);
  EXPECT_EQ(sdk.number("fake_watchdog_units"), 255) << "it lets go by itself";
}

TEST(ForceDimension, ForceAndMotionAreOfTheSameAxes) {
  FakeSdk sdk;
  ForceDimensionDriver driver(spec(), dhd_functions(TANDEM_FAKE_SDK));
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
    driver.step(at(0), {axis, Vec3::Zero()});
    sdk.place(0.01 * sdk.force());
    EXPECT_NEAR((driver.step(at(1), {axis, Vec3::Zero()}).X_DH.p - 0.01 * axis).norm(), 0, 1e-12) << axis.transpose();
  }
}

TEST(ForceDimension, AnUnpluggedDeviceIsLostAndRecoversAndClosesWithZeroForce) {
  FakeSdk sdk;
  {
    ForceDimensionDriver driver(spec(), dhd_functions(TANDEM_FAKE_SDK));
    driver.step(at(0), {Vec3(1, 0, 0), Vec3::Zero()});
    sdk.number("fake_is_there") = 0;
    const DeviceSample lost = driver.step(at(1), {Vec3(1, 0, 0), Vec3::Zero()});
    EXPECT_EQ(lost.state, DeviceState::kLost);
    EXPECT_FALSE(lost.is_valid);
    sdk.number("fake_is_there") = 1;
    EXPECT_EQ(driver.step(at(500), {}).state, DeviceState::kLost) << "looked for once a second";
    EXPECT_EQ(driver.step(at(1100), {Vec3(1, 0, 0), Vec3::Zero()}).state, DeviceState::kReady);
  }
  EXPECT_EQ(sdk.force(), Vec3::Zero());
  EXPECT_EQ(sdk.number("fake_has_force_on"), 0);
  EXPECT_EQ(sdk.number("fake_is_open"), 0);
}

TEST(ForceDimension, WithoutItsWatchdogItIsNotReady) {
  FakeSdk sdk;
  ForceDimensionDriver driver(spec(), dhd_functions(TANDEM_FAKE_SDK));
  sdk.number("fake_refuses_watchdog") = 1;
  const DeviceSample refused = driver.step(at(0), {Vec3(1, 0, 0), Vec3::Zero()});
  EXPECT_EQ(refused.state, DeviceState::kOpening);
  EXPECT_THAT(std::string(refused.reason), HasSubstr("refuses"));
  EXPECT_EQ(sdk.number("fake_is_open"), 0);
  sdk.number("fake_refuses_watchdog") = 0;
  EXPECT_EQ(driver.step(at(1100), {}).state, DeviceState::kReady);
}

TEST(ForceDimension, AForceCountsAsOnUntilTheSdkHasAcceptedZero) {
  FakeSdk sdk;
  ForceDimensionDriver driver(spec(), dhd_functions(TANDEM_FAKE_SDK));
  driver.step(at(0), {});
  EXPECT_FALSE(driver.may_be_on());
  driver.step(at(1), {Vec3(1, 0, 0), Vec3::Zero()});
  EXPECT_TRUE(driver.may_be_on());
  sdk.number("fake_refuses_force") = 1;
  driver.step(at(2), {});
  EXPECT_TRUE(driver.may_be_on()) << "zero did not reach it";
  sdk.number("fake_refuses_force") = 0;
  driver.step(at(1100), {});
  EXPECT_FALSE(driver.may_be_on());
}

TEST(OpenHaptics, AForceCountsAsOnUntilTheSdkHasAcceptedZero) {
  FakeSdk sdk;
  OpenHapticsDriver driver(spec(), hd_functions(TANDEM_FAKE_SDK));
  driver.step(at(0), {Vec3(1, 0, 0), Vec3::Zero()});
  EXPECT_TRUE(driver.may_be_on());
  sdk.number("fake_is_there") = 0;
  driver.step(at(1), {});
  EXPECT_TRUE(driver.may_be_on()) << "zero did not reach it";
  sdk.number("fake_is_there") = 1;
  driver.step(at(1100), {});
  EXPECT_FALSE(driver.may_be_on());
}

TEST(OpenHaptics, IsReadInMillimetresWithinFramesAndFeelsNewtons) {
  FakeSdk sdk;
  OpenHapticsDriver driver(spec(), hd_functions(TANDEM_FAKE_SDK));
  sdk.place(Vec3(10, 20, 30));  // components: to the right, up, towards the user
  sdk.numbers("fake_velocity_mm_per_s")[0] = 100;
  sdk.turn(quaternion_of(Vec3(0, 0.3, 0)));
  sdk.number("fake_buttons") = 1;
  const DeviceSample sample = driver.step(at(0), {Vec3(1, 2, 3), Vec3::Zero()});
  ASSERT_TRUE(sample.is_valid);
  EXPECT_NEAR((sample.X_DH.p - Vec3(0.01, -0.03, 0.02)).norm(), 0, 1e-12);
  EXPECT_NEAR((sample.V_DH.v - Vec3(0.1, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((rotation_vector(sample.X_DH.q) - Vec3(0, 0, 0.3)).norm(), 0, 1e-9) << "about the vertical in both";
  EXPECT_EQ(sample.buttons, kButtonGrab);
  EXPECT_EQ(sdk.force(), Vec3(1, 3, -2));
  EXPECT_EQ(sdk.number("fake_calls_out_of_frame"), 0);
  EXPECT_FALSE(driver.spec().has_torque());
}

TEST(OpenHaptics, AnUnpluggedDeviceIsLostAndRecoversAndClosesWithZeroForce) {
  FakeSdk sdk;
  {
    OpenHapticsDriver driver(spec(), hd_functions(TANDEM_FAKE_SDK));
    driver.step(at(0), {Vec3(1, 0, 0), Vec3::Zero()});
    sdk.number("fake_is_there") = 0;
    EXPECT_EQ(driver.step(at(1), {Vec3(1, 0, 0), Vec3::Zero()}).state, DeviceState::kLost);
    EXPECT_EQ(sdk.force(), Vec3::Zero()) << "the last command must be zero";
    EXPECT_EQ(driver.step(at(1100), {}).state, DeviceState::kLost) << "not there yet";
    sdk.number("fake_is_there") = 1;
    EXPECT_EQ(driver.step(at(2200), {Vec3(1, 0, 0), Vec3::Zero()}).state, DeviceState::kReady);
    EXPECT_EQ(sdk.force(), Vec3(1, 0, 0));
  }
  EXPECT_EQ(sdk.force(), Vec3::Zero());
  EXPECT_EQ(sdk.number("fake_is_open"), 0);
}

TEST(VendorSdk, WithoutItOrWithAnotherVersionItIsSaid) {
  EXPECT_THAT([] { dhd_functions("/nowhere/libdhd.so"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("Force Dimension SDK"), HasSubstr("--library"))));
  EXPECT_THAT(
      [] { dhd_functions(TANDEM_FAKE_SDK_WITHOUT_FORCE); },
      ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("has no dhdSetForceAndTorque"), HasSubstr("dhdSetWatchdog"))));
  EXPECT_THAT([] { hd_functions(TANDEM_FAKE_SDK_WITHOUT_FORCE); },
              ThrowsMessage<std::runtime_error>(HasSubstr("has no hdSetDoublev")));
}

TEST(VendorSdk, IsOpenedByName) {
  FakeSdk sdk;
  for (const char* name : {"forcedimension", "openhaptics"}) {
    DeviceOptions options;
    options.name = name;
    options.library = TANDEM_FAKE_SDK;
    options.profile = find_device_profile(find_device_kind(name).profile);
    EXPECT_NE(open_device(options), nullptr) << name;
    EXPECT_EQ(sdk.number("fake_is_open"), 0) << "closed again";
  }
}

}  // namespace
}  // namespace tandem::devices
