// A device whose transport blocks, behind a seam that does not.
//
//   haptic thread   write() ──▶ newest command ──▶  device thread   driver.step(now, command)
//                   read()  ◀── newest sample  ◀──                  waits for the device, at most some 10 ms
//
// 1. A command that is older than 20 ms is a loop that stands still: the driver is given zero instead, until the loop has
//    called has_let_go() and so knows from where its force has to come back.
// 2. A driver that hangs gives no newer sample: its time stamp grows old, which DeviceReader takes for a fault.
// 3. A program that is stopped or killed sends nothing: a watchdog, where there is one, writes zero in its place. A command that
//    was chosen before the loop knows of that zero is replaced by zero.
// 4. The end, and so the destructor, gives the driver zero before it is closed.
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

/// What opens a device, homes it, keeps it going and opens it again, in steps, without a thread or a clock.
///
/// Thread  the device's
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  /// One exchange with the device, or one step towards one: waits at most 20 ms. Zero on the hand unless it is ready.
  virtual DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) = 0;
  /// The device may show a force: it was given one, and zero was not delivered since. A command that failed or is on its way
  /// counts as given when it is a force, and not when it is zero.
  virtual bool may_be_on() const noexcept = 0;
};

/// A device that is not there, to its driver: when to look for it again, and what to say meanwhile. One that was there
/// once is lost, and stays so for the reason for which it went; one that never was is being opened.
class Absence {
 public:
  /// Once a second after it was lost or looked for, and at first.
  bool is_time_to_look(LocalTime now) noexcept;
  /// It is there: when it goes, it is lost.
  void end() noexcept { was_there_ = true; }
  /// It went.
  void begin(LocalTime now, std::string_view reason) noexcept;
  /// It is still not there.
  void go_on(std::string_view reason) noexcept;
  /// In      reason  a literal, which holds whether it was there before or not
  void say(std::string_view reason) noexcept { reason_ = reason; }
  bool was_there() const noexcept { return was_there_; }
  DeviceSample sample(LocalTime now) const noexcept;

 private:
  LocalTime next_look_{};
  std::string_view reason_;
  bool was_there_ = false;
};

/// Runs a driver on a thread of its own.
class ThreadedDevice final : public Device {
 public:
  /// `realtime_priority` as request_realtime() has it.
  /// `watchdog` is told of each command; null: none.
  explicit ThreadedDevice(std::unique_ptr<DeviceDriver> driver, int realtime_priority = 0,
                          std::shared_ptr<Watchdog> watchdog = nullptr);
  /// Gives the driver zero and ends the thread.
  ~ThreadedDevice() override;
  ThreadedDevice(const ThreadedDevice&) = delete;
  ThreadedDevice& operator=(const ThreadedDevice&) = delete;

  const DeviceSpec& spec() const noexcept override { return spec_; }
  DeviceSample read(LocalTime now) noexcept override;
  /// The driver takes it with its next step: a few milliseconds later at most.
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;
  bool has_let_go() noexcept override;
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
  realtime::Mailbox<std::pair<LocalTime, Wrench>> commands_;  ///< and when each was given
  std::atomic<bool> should_stop_{false};
  std::atomic<bool> gave_zero_{false};  ///< in place of a force, and the loop does not know yet
  std::atomic<bool> may_be_on_{false};  ///< of the driver, and of the command that it is given
  std::thread thread_;
};

}  // namespace tandem::devices
