// Non-blocking device interface for a driver whose transport blocks.
//
//   haptic thread   write() ──▶ newest command ──▶  device thread   driver.step(now, command)
//                   read()  ◀── newest sample  ◀──                  waits for the device, at most about 10 ms
//
// 1. A command older than 20 ms means that the loop hangs: the driver receives zero instead. This lasts until the loop
//    has called has_released_force(), so that it restarts its force from zero.
// 2. A driver that hangs returns no newer sample: its time stamp grows old, which DeviceReader treats as a fault.
// 3. A program that is stopped or killed sends nothing: a watchdog, if there is one, writes zero in its place. Zero
//    also replaces a command that was chosen before the loop was informed of that zero.
// 4. The destructor sends zero to the driver before the driver is closed.
#pragma once

#include <atomic>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

#include "common/realtime/mailbox.hpp"
#include "devices/device.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// Opens a device, homes it, exchanges data and reopens it, in steps, without a thread or a clock of its own.
///
/// Thread  the device's
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  /// One exchange with the device, or one step towards it: waits at most 20 ms. Shows zero unless the device is ready.
  virtual DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) = 0;
  /// The device may show a force: it received one, and zero was not delivered since. A command that failed or is in
  /// transit counts as received if it is a force, and not if it is zero.
  virtual bool may_be_on() const noexcept = 0;
};

/// State of a disconnected device for its driver: schedules reconnection attempts and stores the reason. A device that
/// was connected once is lost and keeps the reason of the loss; otherwise it is being opened.
class Absence {
 public:
  /// Returns true at first, and once a second after a loss or an attempt.
  bool is_attempt_due(LocalTime now) noexcept;
  /// The device is connected; its next disconnection is a loss.
  void end() noexcept { was_connected_ = true; }
  /// The device has disconnected.
  void begin(LocalTime now, std::string_view reason) noexcept;
  /// The device is still disconnected.
  void note_absence(std::string_view reason) noexcept;
  /// In      reason  a literal; it applies whether the device was connected before or not
  void set_reason(std::string_view reason) noexcept { reason_ = reason; }
  bool was_connected() const noexcept { return was_connected_; }
  DeviceSample sample(LocalTime now) const noexcept;

 private:
  LocalTime next_attempt_{};
  std::string_view reason_;
  bool was_connected_ = false;
};

/// Runs a driver on a thread of its own.
class ThreadedDevice final : public Device {
 public:
  /// `realtime_priority` as for request_realtime(). `watchdog` receives a beat for each command; null: none.
  explicit ThreadedDevice(std::unique_ptr<DeviceDriver> driver, int realtime_priority = 0,
                          std::shared_ptr<Watchdog> watchdog = nullptr);
  /// Sends zero to the driver and ends the thread.
  ~ThreadedDevice() override;
  ThreadedDevice(const ThreadedDevice&) = delete;
  ThreadedDevice& operator=(const ThreadedDevice&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  /// Stores the command for the driver's next step, a few milliseconds later at most.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;
  bool has_released_force() noexcept override;
  bool may_be_on() const noexcept override { return may_be_on_.load(std::memory_order_acquire); }

 private:
  void run(int realtime_priority);
  void step(const Wrench& wrench_on_hand_D) noexcept;
  void note_may_be_on(LocalTime now, bool may_be_on) noexcept;
  Wrench newest_command(LocalTime now) noexcept;

  std::shared_ptr<Watchdog> watchdog_;
  std::unique_ptr<DeviceDriver> driver_;
  DeviceSpec spec_;
  realtime::Mailbox<DeviceSample> samples_;
  realtime::Mailbox<std::pair<LocalTime, Wrench>> commands_;  ///< with the time of each write()
  std::atomic<bool> should_stop_{false};
  std::atomic<bool> gave_zero_{false};  ///< zero replaced a force, and the loop is not informed yet
  std::atomic<bool> may_be_on_{false};  ///< state of the driver and of its present command
  std::thread thread_;
};

}  // namespace tandem::devices
