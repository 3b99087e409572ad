// A device whose transport blocks, behind a seam that does not.
//
//   haptic thread   write() ──▶ newest command ──▶  device thread   driver.step(now, command)
//                   read()  ◀── newest sample  ◀──                  waits for the device, at most some 10 ms
//
// 1. A command that is older than 50 ms is a loop that stands still: the driver is given zero instead.
// 2. A driver that hangs gives no newer sample: its time stamp grows old, which DeviceReader takes for a fault.
// 3. The end, and so the destructor, gives the driver zero before it is closed.
#pragma once

#include <atomic>
#include <memory>
#include <string_view>
#include <thread>

#include "common/realtime/mailbox.hpp"
#include "devices/device.hpp"

namespace tandem::devices {

/// What opens a device, homes it, keeps it going and opens it again, in steps, without a thread or a clock.
///
/// Thread  the device's
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  /// One exchange with the device, or one step towards one: waits at most 20 ms. Zero on the hand unless it is ready.
  virtual DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) = 0;
};

/// What a driver says while its device is not ready.
/// In      was_ready  it is lost then, else still being opened
DeviceSample absent_sample(LocalTime now, bool was_ready, std::string_view reason) noexcept;

/// Runs a driver on a thread of its own.
class ThreadedDevice final : public Device {
 public:
  /// `realtime_priority` as request_realtime() has it.
  explicit ThreadedDevice(std::unique_ptr<DeviceDriver> driver, int realtime_priority = 0);
  /// Gives the driver zero and ends the thread.
  ~ThreadedDevice() override;
  ThreadedDevice(const ThreadedDevice&) = delete;
  ThreadedDevice& operator=(const ThreadedDevice&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  /// The driver takes it with its next step: a few milliseconds later at most.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;

 private:
  struct Command {
    LocalTime given{};
    Wrench wrench_on_hand_D;
  };

  void run(int realtime_priority);
  void step(const Wrench& wrench_on_hand_D) noexcept;
  Wrench newest_command(LocalTime now) noexcept;

  std::unique_ptr<DeviceDriver> driver_;
  DeviceSpec spec_;
  realtime::Mailbox<DeviceSample> samples_;
  realtime::Mailbox<Command> commands_;
  std::atomic<bool> should_stop_{false};
  std::thread thread_;
};

}  // namespace tandem::devices
