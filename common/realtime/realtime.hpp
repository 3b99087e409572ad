// What a haptic or room loop asks of the machine, and how it keeps time. Asking never fails: what was not
// granted is returned, printed once by the program, and the loop goes on unless told to insist.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"

namespace tandem::realtime {

/// For the calling thread. Memory is locked with a priority, for the process and what it allocates later: mlockall, and
/// the first 256 KiB of the stack touched, so that the loop meets no page fault. Nor may processors then sleep so deeply that
/// waking takes long (PM QoS, /dev/cpu_dma_latency), until the program ends.
///
/// In      priority  SCHED_FIFO priority 1–99; 0: stay with the normal scheduler
///         cpu       pin to this CPU; −1: do not pin
/// Out     one line for each thing not granted, with the remedy; empty when all was
std::vector<std::string> request_realtime(int priority, int cpu = -1);
/// Puts the calling thread back to the normal scheduler: for work that may take long.
void drop_realtime();
/// Whether the calling thread runs at SCHED_FIFO (or SCHED_RR) priority.
bool has_realtime_priority();

/// How many cores this process may run on, as it was started (`taskset`, a container's share); at least 1.
std::size_t usable_cores();
/// Processor time that a thread of this process has used.
Duration cpu_time(pthread_t thread);
/// SCHED_FIFO `priority` for a thread of this process; 0: the normal scheduler. Returns whether it was granted.
bool set_priority(pthread_t thread, int priority);

/// Sleeps to absolute deadlines start + n·period on SteadyClock's clock, and records how late
/// each wake-up was.
///
/// Thread  the loop's own
class PeriodicTimer {
 public:
  /// In      spin  wakes up to so much ahead, by twice what waking up takes lately, and waits for the deadline without
  ///               sleep: an idle processor may need a tenth of a millisecond to wake up, a busy one microseconds
  /// Fails   std::invalid_argument: period not above 0
  PeriodicTimer(Duration period, LocalTime start, Duration spin = Duration{0});
  /// Sleeps to the next deadline. When that has passed by more than a period, the missed ones are skipped and
  /// counted, so that a late loop does not run a burst to catch up. Returns the deadline that it woke for.
  ///
  /// In      early  may wake so much before the deadline: it does not sleep when that is no farther away, and else sleeps
  ///                less by twice what waking up takes
  LocalTime wait(Duration early = Duration{0});
  /// What the next wait() is for, unless it has been missed by then.
  LocalTime due() const { return next_ + period_; }

  /// The next deadline is a period after `start`; what was missed before is not counted.
  void restart(LocalTime start) { next_ = start; }
  /// Every deadline from the next on is so much later.
  void shift(Duration later) { next_ += later; }

  const Histogram& lateness() const { return lateness_; }
  std::uint64_t missed() const { return missed_; }
  /// Wake-ups more than 25 ms late while running at real-time priority look like the kernel's real-time
  /// throttling (sched_rt_runtime_us); counted here so that a program can say so.
  std::uint64_t throttle_suspects() const { return throttle_suspects_; }

 private:
  Duration period_;
  LocalTime next_;
  Duration spin_;
  Duration waking_{0};  ///< how late wake-ups are, lately
  Histogram lateness_;
  std::uint64_t missed_ = 0;
  std::uint64_t throttle_suspects_ = 0;
};

}  // namespace tandem::realtime
