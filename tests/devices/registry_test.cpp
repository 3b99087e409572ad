// Tests that each listed device can be opened and reports its name, and that error messages list the valid choices.
#include "devices/registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "devices/device_writer.hpp"

namespace tandem::devices {
namespace {

using testing::AllOf;
using testing::HasSubstr;

DeviceOptions with_profile(const char* name) {
  DeviceOptions options;
  options.profile = find_device_profile(name);
  return options;
}

std::string error_of(const DeviceOptions& options) {
  try {
    open_device(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "opened";
}

TEST(DeviceRegistry, NamesEachDeviceOnceAndDescribesItInALine) {
  std::set<std::string_view> names;
  for (const DeviceKind& kind : device_kinds()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_GE(kind.description.size(), 10U) << kind.name;
    EXPECT_EQ(kind.description.find('\n'), std::string_view::npos) << kind.name;
    EXPECT_NO_THROW(find_device_profile(kind.profile)) << kind.name;
  }
  EXPECT_TRUE(names.contains("sim"));
  EXPECT_TRUE(names.contains("mouse"));
}

TEST(DeviceRegistry, TheSimulatedDeviceHasTheLimitsOfItsProfileAndIsReadyAtOnce) {
  const auto device = open_device(with_profile("falcon"));
  EXPECT_EQ(device->spec().name, "falcon");
  EXPECT_FALSE(device->spec().has_torque());
  EXPECT_EQ(device->spec().sensed_rotations, 3) << "the rotations of the simulated hand, not those of a Falcon";
  EXPECT_EQ(device->spec().buttons, kButtonGrab | kButtonClutch);
  EXPECT_EQ(DeviceSample{}.state, DeviceState::kOpening) << "a sample must not be ready by default";
  const DeviceSample sample = device->read(LocalTime{});
  EXPECT_EQ(sample.state, DeviceState::kReady);
  EXPECT_TRUE(sample.reason.empty());
  EXPECT_TRUE(sample.is_valid);
  EXPECT_TRUE(DeviceWriter(*device).write(LocalTime{}, {}));
}

TEST(DeviceRegistry, TheSimulatedHandIsTheRequestedOne) {
  DeviceOptions options = with_profile("sim");
  options.hand = "press-down";
  const auto device = open_device(options);
  DeviceSample sample;
  for (int second = 0; second <= 4; ++second) sample = device->read(LocalTime(std::chrono::seconds(second)));
  EXPECT_LT(sample.X_DH.p.z(), -0.02);
  options.hand = "no-such-hand";
  EXPECT_THAT(error_of(options), AllOf(HasSubstr("no-such-hand"), HasSubstr("press-down")));
}

TEST(DeviceRegistry, AMissingRealDeviceIsReportedWithTheRemedy) {
  for (const DeviceKind& kind : device_kinds()) {
    if (kind.find == nullptr || !kind.find().empty()) continue;
    DeviceOptions options = with_profile(std::string(kind.profile).c_str());
    options.name = kind.name;
    EXPECT_THAT(error_of(options), AllOf(HasSubstr(std::string(kind.name)), HasSubstr("--device sim")));
  }
}

TEST(DeviceRegistry, ARealDeviceWithoutADriverIsAnsweredWithTheSimulatedOne) {
  DeviceOptions options = with_profile("falcon");
  options.name = "touch";
  EXPECT_THAT(error_of(options), AllOf(HasSubstr("\"touch\""), HasSubstr("--device sim --profile touch")));
  options.name = "mine.json";
  EXPECT_THAT(error_of(options), HasSubstr("--device sim --profile mine.json"));
  options.name = "wand";
  EXPECT_THAT(error_of(options), AllOf(HasSubstr("\"wand\""), HasSubstr("use one of: "), HasSubstr("sim, ")));
}

}  // namespace
}  // namespace tandem::devices
