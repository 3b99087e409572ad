// Tests a driver on a separate thread: the forces that it receives, and the use of the samples that it returns.
#include "devices/threaded_device.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "devices/device_reader.hpp"
#include "devices/device_writer.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// State shared by the driver and the test.
struct Seen {
  std::atomic<double> force_n{0};  ///< last force that the driver has received [N]
  std::atomic<double> most_n{0};
  std::atomic<bool> throws{false};
  std::atomic<bool> hangs{false};
  std::atomic<bool> sends_nothing{false};  ///< true: the driver sends no force, but continues to read states
};

class PlainDriver final : public DeviceDriver {
 public:
  explicit PlainDriver(Seen& seen) : seen_(seen) {}
  const DeviceSpec& spec() const noexcept override { return spec_; }
  bool may_be_on() const noexcept override { return seen_.force_n != 0; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override {
    while (seen_.hangs) std::this_thread::sleep_for(milliseconds(1));
    if (!seen_.sends_nothing) seen_.force_n = wrench_on_hand_D.f.norm();
    if (seen_.force_n > seen_.most_n) seen_.most_n = seen_.force_n.load();
    if (seen_.throws) throw std::runtime_error("of this test");
    DeviceSample sample;
    sample.taken = now;
    sample.state = DeviceState::kReady;
    sample.is_valid = true;
    return sample;
  }

 private:
  Seen& seen_;
  DeviceSpec spec_;
};

template <class Done>
bool wait_for(Done is_done) {
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + seconds(30);
  while (!is_done() && clock.now() < give_up) std::this_thread::sleep_for(milliseconds(1));
  return is_done();
}

struct ThreadedDeviceRig {
  bool believes() { return reader.read(clock.now()).is_valid; }
  void push(double newton) { device.write(clock.now(), {Vec3(newton, 0, 0), Vec3::Zero()}); }

  Seen seen;
  SteadyClock clock;
  ThreadedDevice device{std::make_unique<PlainDriver>(seen)};
  DeviceReader reader{device};
};

TEST(ThreadedDevice, AStalledLoopGivesZeroAtTheDevice) {
  ThreadedDeviceRig rig;
  EXPECT_TRUE(wait_for([&rig] {
    rig.push(5);
    return rig.seen.force_n == 5.0;
  }));
  EXPECT_TRUE(wait_for([&rig] { return rig.seen.force_n == 0.0; })) << "without commands the force must become zero";
}

TEST(ThreadedDevice, ALoopThatComesBackHasNoForceBeforeItKnowsThatItsOwnWasLetGo) {
  ThreadedDeviceRig rig;
  EXPECT_TRUE(wait_for([&rig] {
    rig.push(5);
    return rig.seen.force_n == 5.0;
  }));
  EXPECT_FALSE(rig.device.has_released_force());
  EXPECT_TRUE(wait_for([&rig] { return rig.seen.force_n == 0.0; }));
  for (int i = 0; i < 20; ++i) {
    rig.push(5);
    std::this_thread::sleep_for(milliseconds(1));
    ASSERT_EQ(rig.seen.force_n, 0.0) << "the device must not jump to a force that the loop considers displayed";
  }
  DeviceWriter writer(rig.device);
  const auto push = [&] { return writer.write(rig.clock.now(), {Vec3(1, 0, 0), Vec3::Zero()}); };
  EXPECT_FALSE(push());
  EXPECT_TRUE(writer.written().f.isZero(0));
  EXPECT_TRUE(wait_for([&] { return push() && rig.seen.force_n == 1.0; }));
}

TEST(ThreadedDevice, TheSampleOfAHangingDriverIsInvalid) {
  ThreadedDeviceRig rig;
  EXPECT_TRUE(wait_for([&rig] { return rig.believes(); }));
  rig.seen.hangs = true;
  EXPECT_TRUE(wait_for([&rig] { return !rig.believes(); }));
  rig.seen.hangs = false;
  EXPECT_TRUE(wait_for([&rig] { return rig.believes(); }));
}

/// Returns the last byte that was written to a pipe, or −1 if there is none.
int newest_byte(int pipe) {
  std::array<std::uint8_t, 64> bytes{};
  const ssize_t count = read(pipe, bytes.data(), bytes.size());
  return count > 0 ? bytes[static_cast<std::size_t>(count) - 1] : -1;
}

TEST(ThreadedDevice, AWatchdogSaysZeroForADriverThatHangsWithAForceAndTheHandIsLetGo) {
  int ends[2] = {-1, -1};
  ASSERT_EQ(pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const auto watchdog = std::make_shared<Watchdog>(0);
  ASSERT_TRUE(watchdog->watch_over({.descriptor = ends[1], .usb_endpoint = std::nullopt, .bytes = {42}}));
  Seen seen;
  const SteadyClock clock;
  ThreadedDevice device(std::make_unique<PlainDriver>(seen), 0, watchdog);
  DeviceWriter writer(device);
  const auto push = [&] { return writer.write(clock.now(), {Vec3(1, 0, 0), Vec3::Zero()}); };
  EXPECT_TRUE(wait_for([&] { return push() && seen.force_n == 1.0; }));

  seen.hangs = true;
  int newest = -1;
  EXPECT_TRUE(wait_for([&] { return (newest = std::max(newest, newest_byte(ends[0]))) == 42; }));
  EXPECT_FALSE(push());
  EXPECT_EQ(writer.written().f.norm(), 0.0) << "the force must restart from zero";
  EXPECT_TRUE(push()) << "once only";
  seen.hangs = false;
  EXPECT_TRUE(wait_for([&] { return push() && seen.force_n == 1.0; }));
}

TEST(ThreadedDevice, AForceWhoseZeroTheDriverCouldNotSendIsOnAlthoughStatesCome) {
  int ends[2] = {-1, -1};
  ASSERT_EQ(pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const auto watchdog = std::make_shared<Watchdog>(0);
  ASSERT_TRUE(watchdog->watch_over({.descriptor = ends[1], .usb_endpoint = std::nullopt, .bytes = {42}}));
  Seen seen;
  const SteadyClock clock;
  ThreadedDevice device(std::make_unique<PlainDriver>(seen), 0, watchdog);
  DeviceWriter writer(device);
  DeviceReader reader(device);
  EXPECT_TRUE(wait_for([&] {
    writer.write(clock.now(), {Vec3(1, 0, 0), Vec3::Zero()});
    return seen.force_n == 1.0;
  }));
  seen.sends_nothing = true;
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(writer.write_zero(clock.now())) << i;
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_TRUE(wait_for([&] { return reader.read(clock.now()).is_valid; }));
  seen.hangs = true;
  int written = -1;
  EXPECT_TRUE(wait_for([&] { return (written = std::max(written, newest_byte(ends[0]))) == 42; }))
      << "the watchdog must write zero";
  seen.hangs = seen.sends_nothing = false;
  EXPECT_TRUE(wait_for([&] { return writer.write_zero(clock.now()); }));
}

TEST(ThreadedDevice, AWatchdogLeavesADriverAloneThatHangsWithoutAForce) {
  int ends[2] = {-1, -1};
  ASSERT_EQ(pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const auto watchdog = std::make_shared<Watchdog>(0);
  ASSERT_TRUE(watchdog->watch_over({.descriptor = ends[1], .usb_endpoint = std::nullopt, .bytes = {42}}));
  ThreadedDeviceRig rig;
  watchdog->beat(rig.clock.now(), false);
  std::this_thread::sleep_for(4 * Watchdog::kMaxSilence);
  EXPECT_FALSE(watchdog->has_released_force());
  watchdog->release();
  EXPECT_EQ(newest_byte(ends[0]), -1);
}

TEST(ThreadedDevice, ADriverThatThrowsIsLostAndMayComeBack) {
  ThreadedDeviceRig rig;
  EXPECT_TRUE(wait_for([&rig] { return rig.believes(); }));
  rig.seen.throws = true;
  EXPECT_TRUE(wait_for([&rig] { return rig.device.read(rig.clock.now()).state == DeviceState::kLost; }));
  rig.seen.throws = false;
  EXPECT_TRUE(wait_for([&rig] { return rig.believes(); }));
}

TEST(ThreadedDevice, ItsEndIsZeroAndNothingThatIsNotFiniteIsTaken) {
  Seen seen;
  {
    ThreadedDevice device(std::make_unique<PlainDriver>(seen));
    const SteadyClock clock;
    EXPECT_TRUE(wait_for([&] {
      device.write(clock.now(), {Vec3(3, 0, 0), Vec3::Zero()});
      return seen.force_n == 3.0;
    }));
    EXPECT_FALSE(device.write(clock.now(), {Vec3(0, std::nan(""), 0), {}}));
  }
  EXPECT_EQ(seen.force_n, 0.0);
  EXPECT_EQ(seen.most_n, 3.0);
}

}  // namespace
}  // namespace tandem::devices
