// The threads that step the rooms.
//
// Rooms are dealt to at most (cores − 1) worker threads, so that one core is left for io. A worker with several
// rooms steps the one whose deadline is next; each room keeps absolute deadlines of its own period. Workers run at
// one SCHED_FIFO priority, below the io thread: reading a datagram takes microseconds, and a step that used the
// datagram before it would be a millisecond older.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/realtime/realtime.hpp"
#include "server/room/room.hpp"

namespace tandem::server {

/// How well a room's loop kept its time.
struct RoomTiming {
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  ///< steps that ended after the next deadline (kFaultOverrun)
  std::uint64_t missed = 0;    ///< deadlines skipped
  Histogram lateness;          ///< of waking up
  Histogram step_time;
};

class RoomScheduler {
 public:
  /// `after_step` runs on a worker thread after each step: no lock, no wait.
  RoomScheduler(std::vector<Room*> rooms, realtime::RealtimeRequest realtime,
                std::function<void(const Room&)> after_step);
  /// Stops.
  ~RoomScheduler();
  RoomScheduler(const RoomScheduler&) = delete;
  RoomScheduler& operator=(const RoomScheduler&) = delete;

  /// Starts the workers. Returns what they asked for and were not granted, each line once.
  std::vector<std::string> start();
  void stop();
  /// In the order of the rooms; after stop().
  std::vector<RoomTiming> timings() const;

 private:
  struct Loop;
  struct Worker;
  void run(Worker& worker);
  void step_next(Worker& worker);

  realtime::RealtimeRequest realtime_;
  std::function<void(const Room&)> after_step_;
  std::vector<std::unique_ptr<Loop>> loops_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::atomic<bool> is_stopping_{false};
};

}  // namespace tandem::server
