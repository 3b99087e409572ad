// Tests the Falcon's driver with the real libusb. umockdev emulates the kernel's USB devices, and the simulator
// receives every URB. The test must run under umockdev-wrapper, which intercepts the system calls of libusb.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <umockdev.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "devices/device_profile.hpp"
#include "devices/device_reader.hpp"
#include "devices/device_writer.hpp"
#include "devices/falcon/falcon_driver.hpp"
#include "tests/devices/falcon_simulator.hpp"
#include "tests/devices/falcon_usb_bus.hpp"

#ifdef __SANITIZE_ADDRESS__
// libusb 1.0.26 leaks 56 bytes if a context is closed after a device was unplugged.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libusb-1.0";
}
#endif

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kFirmwareSize = 7914;
FalconSettings settings() {
  const DeviceProfile profile = find_device_profile("falcon");
  FalconSettings result{profile.spec, {}, 10000};
  for (std::size_t i = 0; i < kFirmwareSize; ++i)
    result.firmware.push_back(static_cast<std::uint8_t>(i * 31 + i / 256));
  return result;
}

/// Runs ticks like the haptic loop until `is_over` returns true. While samples are valid, writes `force`. Returns false
/// if `is_over` has not become true after 60 s.
template <class Over>
bool tick_until(Device& device, const Vec3& force, Over is_over) {
  DeviceReader reader(device);
  DeviceWriter writer(device);
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + seconds(60);
  for (LocalTime now = clock.now(); now < give_up; now = clock.now()) {
    const DeviceSample sample = reader.read(now);
    writer.write(now, sample.is_valid ? Wrench{force, Vec3::Zero()} : Wrench{});
    if (is_over(sample)) return true;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return false;
}

bool tick_until_state(Device& device, DeviceState state) {
  return tick_until(device, Vec3::Zero(), [state](const DeviceSample& sample) { return sample.state == state; });
}

std::unique_ptr<ThreadedDevice> open_device() {
  std::string_view reason;
  auto port = open_falcon_usb_port(reason);
  EXPECT_NE(port, nullptr) << reason;
  const OpenFalcon open = [](std::string_view& why) { return open_falcon_usb_port(why); };
  return std::make_unique<ThreadedDevice>(std::make_unique<FalconDriver>(settings(), open, std::move(port)));
}

struct FalconUsb : testing::Test {
  FalconUsb() { EXPECT_TRUE(umockdev_in_mock_environment()) << "run this by umockdev-wrapper"; }
  FalconSimulator falcon{kFirmwareSize};
  UsbBus bus{falcon};
};

TEST_F(FalconUsb, IsFoundAndCanBeOpened) {
  const auto found = find_falcons();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].where, "USB bus 1, device 11");
  EXPECT_EQ(found[0].problem, "");
}

TEST_F(FalconUsb, LoadsHomesAndShowsAForceAndItsEndIsZero) {
  auto device = open_device();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kHoming));
  EXPECT_EQ(bus.with_falcon([](FalconSimulator& f) { return f.uploaded; }), settings().firmware);
  bus.with_falcon([](FalconSimulator& f) { f.grip_m = Vec3(0, 0, 0.078); });
  ASSERT_TRUE(tick_until(*device, Vec3::Zero(), [this](const DeviceSample&) {
    return bus.with_falcon([](FalconSimulator& f) { return f.lights_and_home == (kFalconBlue | kFalconHome); });
  }));
  bus.with_falcon([](FalconSimulator& f) { f.grip_m = Vec3(0, 0, 0.175); });
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kReady));
  bus.with_falcon([](FalconSimulator& f) { f.grip_m = Vec3(0, 0, 0.13); });
  int believed = 0;
  EXPECT_TRUE(tick_until(*device, Vec3(0, 0, 2), [&believed](const DeviceSample& sample) {
    believed += sample.is_valid ? 1 : 0;
    return believed >= 300;
  }));
  // Waits for a force at the motors. The force may be zero at first. To look at the motors, the condition waits for the
  // lock of the bus between ticks, and a long wait counts as a stall of the loop.
  EXPECT_TRUE(tick_until(*device, Vec3(0, 0, 2), [this](const DeviceSample&) {
    return bus.with_falcon([](FalconSimulator& f) { return !f.motors.isZero(); });
  }));
  device.reset();
  EXPECT_TRUE(bus.with_falcon([](FalconSimulator& f) { return f.motors.isZero(); }));
  EXPECT_GE(bus.cancelled, 1);
  EXPECT_EQ(bus.outstanding, 0) << "each transfer was waited for";
}

TEST_F(FalconUsb, GarbageAndSplitRepliesAreHandled) {
  bus.with_falcon([](FalconSimulator& f) {
    f.has_firmware = f.is_homed = true;
    f.faults.sends_garbage = f.faults.splits_replies = true;
  });
  auto device = open_device();
  int believed = 0;
  EXPECT_TRUE(tick_until(*device, Vec3::Zero(), [&believed](const DeviceSample& sample) {
    believed += sample.is_valid ? 1 : 0;
    return believed >= 50;
  }));
}

TEST_F(FalconUsb, ZeroIsSaidByTheDescriptorThatIsOpen) {
  bus.with_falcon([](FalconSimulator& f) { f.has_firmware = f.is_homed = true; });
  EXPECT_FALSE(falcon_zero()) << "no device is open";
  std::string_view reason;
  const auto port = open_falcon_usb_port(reason);
  ASSERT_NE(port, nullptr) << reason;
  ASSERT_TRUE(port->control(FtdiRequest::kBaud, kFtdiBaudRun));
  ASSERT_TRUE(port->write(falcon_request(FalconCounts(1000, -2000, 3000), kFalconGreen)));
  std::array<std::uint8_t, 64> reply{};
  while (bus.with_falcon([](FalconSimulator& f) { return f.motors.isZero(); }))
    static_cast<void>(port->read(reply, milliseconds(5)));
  const auto zero = falcon_zero();
  ASSERT_TRUE(zero);
  EXPECT_TRUE(send_zero(*zero));
  EXPECT_TRUE(bus.with_falcon([](FalconSimulator& f) { return f.motors.isZero(); }));
}

TEST_F(FalconUsb, UnpluggedItIsLostAndComesBack) {
  bus.with_falcon([](FalconSimulator& f) { f.has_firmware = f.is_homed = true; });
  auto device = open_device();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kReady));
  bus.unplug();
  ASSERT_TRUE(tick_until_state(*device, DeviceState::kLost));
  bus.plug_in();
  EXPECT_TRUE(tick_until_state(*device, DeviceState::kReady));
}

}  // namespace
}  // namespace tandem::devices
