// Thread that owns the hand: ticks a HapticCore at 1 kHz against absolute deadlines.
//
//   start() ─▶ requests priority and locked memory, reports refusals
//            ─▶ wait for deadline → core.tick(now) → record into the trace ring → wake the io thread   (each ms)
//   request_stop(), stop() or the duration's end
//            ─▶ begin_shutdown, ticks on until nothing is displayed and the device took a zero (at most 50 ms)
//
// The only shared data are the ring of tick records (haptic writes, the owner reads) and three atomics. Shutdown needs
// only this thread: the hand is released even while the owner is blocked in a write to a terminal.
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
  int realtime_priority = 0;  ///< argument of realtime::request_realtime()
  int cpu = -1;               ///< argument of realtime::request_realtime()
  /// Whether to use realtime::keep_awake(); none: as realtime::should_keep_awake() decides.
  std::optional<bool> keeps_awake = std::nullopt;
  std::optional<Duration> duration = std::nullopt;  ///< since HapticCore::began_at(); none: until request_stop()
  /// Capacity of the ring: unread records beyond it are lost and counted. 4 s at 1 kHz.
  std::size_t trace_capacity = 4096;
};

/// Timing of the loop; complete after stop().
struct HapticLoopReport {
  std::uint64_t ticks_run = 0;
  std::uint64_t ticks_expected = 0;  ///< number of deadlines between the first and the last, met or missed
  double tick_rate_hz = 0;           ///< mean, over the whole run
  Histogram lateness;
  Histogram tick;  ///< duration of a tick
  std::uint64_t missed = 0;
  std::uint64_t throttle_suspects = 0;  ///< only counted at real-time priority
  bool keeps_awake = false;
  /// False: the 50 ms ran out. Zero was then written at once; a failing device may not have accepted it.
  bool became_quiet = true;
};

/// Runs the haptic thread.
class HapticLoop {
 public:
  /// `after_tick` is called on the haptic thread after each tick: it must not block, allocate or throw.
  HapticLoop(HapticLoopSettings settings, HapticCore& core, std::function<void()> after_tick);
  /// Calls stop().
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts the thread. Returns the real-time rights that were refused, once the thread has requested them.
  std::vector<std::string> start();
  /// True if the thread's processor is kept awake (realtime::keep_awake()). Valid after start().
  bool keeps_awake() const { return report_.keeps_awake; }
  /// Requests the thread to ramp the force to zero and end; does not wait for it.
  /// Thread  any; cannot block
  void request_stop() noexcept { should_stop_.store(true, std::memory_order_relaxed); }
  /// True once the hand is released and the thread has finished.
  /// Thread  any
  bool is_over() const noexcept { return is_over_.load(std::memory_order_acquire); }
  /// Ramps the force to zero and joins the thread. Idempotent.
  void stop();

  /// Takes the oldest unread tick record; returns false if there is none.
  /// Thread  one reader
  bool pop(TickRecord& record) { return trace_.pop(record); }
  /// Number of records lost because they were not read in time.
  std::uint64_t trace_overflows() const { return trace_overflows_.load(std::memory_order_relaxed); }
  /// Valid after stop().
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
