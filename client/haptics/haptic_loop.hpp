// The thread that owns the hand: ticks a HapticCore at 1 kHz against absolute deadlines.
//
//   start() ─▶ asks for priority and locked memory, reports what was refused
//            ─▶ wait for deadline → core.tick(now) → record into the trace ring → wake the io thread   (each ms)
//   request_stop(), stop() or the duration's end
//            ─▶ begin_shutdown, ticks on until nothing is displayed and the device took a zero (at most 50 ms)
//
// Nothing is shared but the ring of tick records (haptic writes, the owner reads) and three atomics. The end needs
// nobody but this thread: the hand is let go even while the owner is stuck in a write to a terminal.
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
  int realtime_priority = 0;  ///< as request_realtime() has it
  int cpu = -1;               ///< likewise
  /// Whether realtime::keep_awake(); none: where realtime::should_keep_awake().
  std::optional<bool> keeps_awake = std::nullopt;
  std::optional<Duration> duration = std::nullopt;  ///< since HapticCore::began_at(); none: until request_stop()
  /// Records that the reader may fall behind by before they are lost (and counted): 4 s at 1 kHz.
  std::size_t trace_capacity = 4096;
};

/// How well the loop kept time; complete after stop().
struct HapticLoopReport {
  std::uint64_t ticks_run = 0;
  std::uint64_t ticks_expected = 0;  ///< deadlines between the first and the last, whether met or not
  double tick_rate_hz = 0;           ///< mean, over the whole run
  Histogram lateness;
  Histogram tick;  ///< how long one takes
  std::uint64_t missed = 0;
  std::uint64_t throttle_suspects = 0;  ///< only counted at real-time priority
  bool keeps_awake = false;
  /// False: the 50 ms ran out, and zero was written at once or, by a failing device, not taken.
  bool became_quiet = true;
};

/// Runs the haptic thread.
class HapticLoop {
 public:
  /// `after_tick` is called on the haptic thread after each tick: it must not block, allocate or throw.
  HapticLoop(HapticLoopSettings settings, HapticCore& core, std::function<void()> after_tick);
  /// Stops.
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts the thread; returns once it has asked for its real-time rights, with what was not granted.
  std::vector<std::string> start();
  /// Whether the thread's processor is kept awake (realtime::keep_awake()). After start().
  bool keeps_awake() const { return report_.keeps_awake; }
  /// Tells the thread to show the hand out and end, and does not wait for it.
  /// Thread  any; cannot block
  void request_stop() noexcept { should_stop_.store(true, std::memory_order_relaxed); }
  /// The hand has been let go and the thread does nothing more.
  /// Thread  any
  bool is_over() const noexcept { return is_over_.load(std::memory_order_acquire); }
  /// Shows the hand out and joins the thread. Idempotent.
  void stop();

  /// The oldest tick not yet taken; false when there is none.
  /// Thread  one reader
  bool pop(TickRecord& record) { return trace_.pop(record); }
  /// Records lost because nobody read them in time.
  std::uint64_t trace_overflows() const { return trace_overflows_.load(std::memory_order_relaxed); }
  /// After stop().
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
