// Haptic thread: calls HapticCore::tick() at 1 kHz with absolute deadlines.
//
//   start() ─▶ request priority and locked memory, report refusals
//            ─▶ wait for deadline → core.tick(now) → record into the trace ring → wake the io thread   (each ms)
//   request_stop(), stop() or end of the duration
//            ─▶ begin_shutdown, continue ticks until no force is displayed and the device accepted a zero (≤ 50 ms)
//
// The only shared data are the ring of tick records (written by the haptic thread, read by the owner) and three
// atomics. The shutdown depends on no other thread: the force is removed even if the owner is blocked in a write to a
// terminal.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/haptics/haptic_core.hpp"
#include "common/realtime/realtime.hpp"
#include "common/realtime/ring.hpp"

namespace tandem::client {

struct HapticLoopSettings {
  Duration period{std::chrono::milliseconds(1)};
  int realtime_priority = 0;  ///< SCHED_FIFO priority, see realtime::request_realtime()
  int cpu = -1;               ///< CPU of the thread, see realtime::request_realtime()
  /// Whether the loop keeps its processor awake (realtime::keep_awake()). Empty: realtime::should_keep_awake() decides.
  std::optional<bool> keeps_awake = std::nullopt;
  /// Time from HapticCore::began_at() after which the loop ends. Empty: the loop runs until request_stop().
  std::optional<Duration> duration = std::nullopt;
  /// Capacity of the ring in records: 4 s at 1 kHz. If the ring is full, new records are dropped and counted.
  std::size_t trace_capacity = 4096;
};

/// Timing of the loop; complete after stop().
struct HapticLoopReport {
  std::uint64_t ticks_run = 0;
  std::uint64_t ticks_expected = 0;  ///< number of deadlines in the run, including missed deadlines
  double tick_rate_hz = 0;           ///< mean rate over the whole run
  Histogram lateness;
  Histogram tick;  ///< durations of the ticks
  std::uint64_t missed = 0;
  /// Number of wake-ups that the kernel has probably delayed by its real-time throttling (realtime.hpp). Counted only
  /// at real-time priority.
  std::uint64_t throttle_suspects = 0;
  bool keeps_awake = false;
  /// True if the force was ramped to zero within 50 ms at the end. False: zero was written at once, and a failing
  /// device may have refused it.
  bool became_quiet = true;
};

/// Owns and runs the haptic thread.
class HapticLoop {
 public:
  /// In      after_tick  called on the haptic thread after each tick; must not block, allocate or throw
  HapticLoop(HapticLoopSettings settings, HapticCore& core, std::function<void()> after_tick);
  /// Calls stop().
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts the thread and waits until it has requested real-time properties. Returns the requests that were refused.
  std::vector<std::string> start();
  /// Returns whether the thread's processor is kept awake (realtime::keep_awake()). Valid after start().
  bool keeps_awake() const { return report_.keeps_awake; }
  /// Requests that the thread ramps the force to zero and ends. Does not wait for the end.
  /// Thread  any; does not block
  void request_stop() noexcept { should_stop_.store(true, std::memory_order_relaxed); }
  /// Returns true once the thread has written zero to the device and finished.
  /// Thread  any
  bool is_over() const noexcept { return is_over_.load(std::memory_order_acquire); }
  /// Ramps the force to zero and joins the thread. May be called repeatedly.
  void stop();

  /// Reads and removes the oldest unread tick record. Returns false if there is none.
  /// Thread  always the same thread, for example the owner
  bool pop(TickRecord& record) { return trace_.pop(record); }
  /// Returns the number of records that were dropped because the ring was full.
  std::uint64_t trace_overflows() const { return trace_overflows_.load(std::memory_order_relaxed); }
  /// Returns the timing of the run. Valid after stop().
  const HapticLoopReport& report() const { return report_; }

 private:
  void run(const std::function<void(std::vector<std::string>)>& on_ready);
  bool is_due(LocalTime deadline) const noexcept;
  void tick(const Clock& clock) noexcept;
  LocalTime show_out(realtime::PeriodicTimer& timer, const Clock& clock);

  HapticLoopSettings settings_;
  HapticCore& core_;
  std::function<void()> after_tick_;
  realtime::Ring<TickRecord> trace_;
  std::atomic<std::uint64_t> trace_overflows_{0};
  std::atomic<bool> should_stop_{false};
  std::atomic<bool> is_over_{false};
  HapticLoopReport report_;
  std::thread thread_;
};

}  // namespace tandem::client
