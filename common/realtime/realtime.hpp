// Real-time requests of a haptic or room loop, and its timer. A request never fails: the program receives a list of the
// resources not granted, prints it once, and continues unless told to insist.
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

/// Requests real-time properties for the calling thread. A priority implies locked memory: that of the process, with
/// later allocations (mlockall). The first 256 KiB of the stack are touched, so that the loop has no page faults.
/// Processors then may not sleep so deeply that waking takes long (PM QoS, /dev/cpu_dma_latency), until the program
/// ends.
///
/// In      priority  SCHED_FIFO priority 1–99; 0: stay with the normal scheduler
///         cpu       pin to this CPU; −1: do not pin
/// Out     one line with the remedy for each resource not granted; empty if all were
std::vector<std::string> request_realtime(int priority, int cpu = -1);
/// Returns the calling thread to the normal scheduler: for work that may take long.
void drop_realtime();
/// Whether the calling thread runs at SCHED_FIFO (or SCHED_RR) priority.
bool has_realtime_priority();

/// Number of cores that this process may use (`taskset`, the quota of a container's cgroup); at least 1.
std::size_t usable_cores();
/// Number of cores of a cgroup's quota, rounded up and at least 1; nothing without a limit, or for another text.
///
/// In      cpu_max  text of the file cpu.max (cgroup v2): processor time and period in µs, "200000 100000", or "max …"
std::optional<std::size_t> cores_of_quota(const std::string& cpu_max);
/// Processor time that a thread of this process has used.
Duration cpu_time(pthread_t thread);
/// SCHED_FIFO `priority` for a thread of this process; 0: the normal scheduler. Returns whether it was granted.
bool set_priority(pthread_t thread, int priority);

/// Sleeps to absolute deadlines start + n·period on SteadyClock's clock, and records the lateness of each wake-up.
///
/// Thread  the loop's own
class PeriodicTimer {
 public:
  /// In      spin  maximum time to wake up before the deadline and poll: twice the recent wake-up delay. An idle
  ///               processor may need a tenth of a millisecond to wake up, a busy one microseconds
  /// Fails   std::invalid_argument: period not above 0
  PeriodicTimer(Duration period, LocalTime start, Duration spin = Duration{0});
  /// Sleeps to the next deadline and returns it. If that has passed by more than a period, skips and counts the missed
  /// deadlines: a late loop does not run a burst to catch up.
  ///
  /// In      early  permitted time to return before the deadline. No sleep if the deadline is no farther away; else the
  ///                sleep is shorter by twice the recent wake-up delay
  LocalTime wait(Duration early = Duration{0});
  /// Deadline of the next wait(), unless it has been missed by then.
  LocalTime due() const { return next_ + period_; }

  /// Sets the next deadline to a period after `start`; earlier deadlines do not count as missed.
  void restart(LocalTime start) { next_ = start; }
  /// Delays all following deadlines by `later`.
  void shift(Duration later) { next_ += later; }

  const Histogram& lateness() const { return lateness_; }
  std::uint64_t missed() const { return missed_; }
  /// Wake-ups more than 25 ms late at real-time priority look like the kernel's real-time throttling
  /// (sched_rt_runtime_us). They are counted so that a program can report them.
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
