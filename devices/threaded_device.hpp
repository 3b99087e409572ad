// Non-blocking device around a driver whose transport blocks: the driver runs on a separate thread.
//
//   haptic thread   write() ──▶ newest command ──▶  device thread   driver.step(now, command)
//                   read()  ◀── newest sample  ◀──                  waits for the device, at most about 10 ms
//
// Behaviour if a part fails:
// 1. The haptic loop hangs: when its last command is older than 20 ms, the driver receives zero instead. The zero
//    remains until the loop has called has_released_force(), so that the loop restarts its force from zero.
// 2. The driver hangs: no new samples arrive. DeviceReader treats the growing age of the last sample as a fault.
// 3. The program is stopped or killed: the watchdog, if there is one, writes zero. Commands that the loop chose before
//    it was informed of this zero are replaced by zero, too.
// 4. The device is destroyed: the destructor sends zero to the driver before the driver is closed.
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

/// Opens a device, homes it, exchanges data with it, and reopens it after a loss. Each call of step() executes one step
/// of this work. A driver has no thread and no clock.
///
/// Thread  the thread of the device
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  /// Exchanges data with the device once, or performs one step of opening or homing. Waits at most 20 ms. Displays zero
  /// force unless the device is ready.
  virtual DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) = 0;
  /// Returns whether the device may display a force: a force was sent, and no zero has been delivered since. In doubt
  /// the result is true: a force counts as delivered, and a zero as not delivered, while the transfer is pending or if
  /// it has failed.
  virtual bool may_be_on() const noexcept = 0;
};

/// State of a disconnected device, for use in its driver. It schedules connection attempts and stores the reason of the
/// absence. A device that was connected before is reported as lost, any other device as opening.
class Absence {
 public:
  /// Returns whether to try to connect now. It returns true at the first call, and then a second after each loss or
  /// each earlier attempt.
  bool is_attempt_due(LocalTime now) noexcept;
  /// Records that the device is connected. After this call, a disconnection is reported as a loss.
  void end() noexcept { was_connected_ = true; }
  /// Records that the device has disconnected.
  void begin(LocalTime now, std::string_view reason) noexcept;
  /// Records that the device remains disconnected. If it was connected before, the reason of the loss is kept.
  void note_absence(std::string_view reason) noexcept;
  /// In      reason  a string literal; replaces the stored reason even if the device was connected before
  void set_reason(std::string_view reason) noexcept { reason_ = reason; }
  bool was_connected() const noexcept { return was_connected_; }
  DeviceSample sample(LocalTime now) const noexcept;

 private:
  LocalTime next_attempt_{};
  std::string_view reason_;
  bool was_connected_ = false;
};

/// Runs a driver on a separate thread.
class ThreadedDevice final : public Device {
 public:
  /// In      realtime_priority  see request_realtime()
  ///         watchdog           watchdog of the device; receives a sign of life (beat) for each command; may be null
  explicit ThreadedDevice(std::unique_ptr<DeviceDriver> driver, int realtime_priority = 0,
                          std::shared_ptr<Watchdog> watchdog = nullptr);
  /// Sends zero to the driver and ends the thread.
  ~ThreadedDevice() override;
  ThreadedDevice(const ThreadedDevice&) = delete;
  ThreadedDevice& operator=(const ThreadedDevice&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  /// Stores the command. The driver sends it in its next step, at most a few milliseconds later.
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
  realtime::Mailbox<std::pair<LocalTime, Wrench>> commands_;  ///< commands, each with the time of its write()
  std::atomic<bool> should_stop_{false};
  /// True: a zero has replaced a force, and the haptic loop was not informed of it yet (has_released_force())
  std::atomic<bool> gave_zero_{false};
  std::atomic<bool> may_be_on_{false};  ///< true: the device may display a force, or a force is in transit to it
  std::thread thread_;
};

}  // namespace tandem::devices
