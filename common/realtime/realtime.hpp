// Requests for real-time properties of a loop, and the loop's periodic timer. A request never fails; it returns a list
// of the resources that the system did not grant. The program prints this list once and continues, unless an option of
// the program requires all resources.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::realtime {

/// Requests real-time properties for the calling thread. If the priority is above 0, the function also prevents page
/// faults and slow wake-ups of the loop:
/// * The memory of the process is locked, including later allocations (mlockall).
/// * The first 256 KiB of the stack are touched.
/// * Idle states with a long wake-up latency are disabled until the program ends (PM QoS, /dev/cpu_dma_latency).
///
/// In      priority  SCHED_FIFO priority, 1–99; 0: the thread keeps the normal scheduler
///         cpu       CPU to which the thread is pinned; −1: not pinned
/// Out     one line with the remedy for each resource not granted; empty if all were granted
std::vector<std::string> request_realtime(int priority, int cpu = -1);
/// Returns the calling thread to the normal scheduler, for example before work that takes long.
void drop_realtime();
/// Returns whether the calling thread runs at SCHED_FIFO (or SCHED_RR) priority.
bool has_realtime_priority();

/// Returns the number of cores that this process may use (limited by `taskset` and by the quota of a container's
/// cgroup); at least 1.
std::size_t usable_cores();
/// Returns the number of cores that a cgroup's quota permits, rounded up, at least 1. Returns nothing without a quota
/// or for invalid text.
///
/// In      cpu_max  text of the file cpu.max (cgroup v2): processor time and period in µs, "200000 100000", or "max …"
std::optional<std::size_t> cores_of_quota(const std::string& cpu_max);
/// Returns the processor time that a thread of this process has used.
Duration cpu_time(pthread_t thread);
/// Sets SCHED_FIFO `priority` for a thread of this process; 0 sets the normal scheduler. Returns whether it was
/// granted.
bool set_priority(pthread_t thread, int priority);

/// Sleeps until absolute deadlines start + n·period on the clock of SteadyClock, and records the lateness of each
/// wake-up.
///
/// Thread  the thread of the loop
class PeriodicTimer {
 public:
  /// In      spin  longest time before a deadline at which the sleep may end; after the sleep, wait() polls the clock.
  ///               If twice the recent wake-up delay is less, the sleep ends only that time before the deadline: up to
  ///               a tenth of a millisecond on an idle processor, microseconds on a busy one
  /// Fails   std::invalid_argument: period not above 0
  PeriodicTimer(Duration period, LocalTime start, Duration spin = Duration{0});
  /// Sleeps until the next deadline and returns it. If that deadline passed more than one period ago, skips and counts
  /// the missed deadlines. A late loop therefore does not run a burst of ticks to catch up.
  ///
  /// In      early  time before the deadline from which wait() may return:
  ///         * If the deadline is no farther away than `early`, wait() returns at once.
  ///         * Otherwise wait() first sleeps. The sleep ends before the deadline by twice the recent wake-up delay, but
  ///           at most by the larger of `early` and `spin`. Then wait() polls the clock until the time `early` before
  ///           the deadline.
  LocalTime wait(Duration early = Duration{0});
  /// Returns the deadline for which the next wait() will sleep if no deadline is missed until then.
  LocalTime due() const { return next_ + period_; }

  /// Sets the next deadline to one period after `start`. All deadlines before it are dropped and do not count as
  /// missed.
  void restart(LocalTime start) { next_ = start; }
  /// Delays all following deadlines by `later`.
  void shift(Duration later) { next_ += later; }

  const Histogram& lateness() const { return lateness_; }
  std::uint64_t missed() const { return missed_; }
  /// Returns the number of wake-ups that were more than 25 ms late. At real-time priority the probable cause is the
  /// kernel's real-time throttling (sched_rt_runtime_us).
  std::uint64_t throttle_suspects() const { return throttle_suspects_; }

 private:
  Duration period_;
  LocalTime next_;
  Duration spin_;
  Duration waking_{0};  ///< mean recent wake-up delay
  Histogram lateness_;
  std::uint64_t missed_ = 0;
  std::uint64_t throttle_suspects_ = 0;
};

}  // namespace tandem::realtime
