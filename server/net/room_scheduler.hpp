// Threads that step the rooms of a server.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/time.hpp"
#include "common/realtime/realtime.hpp"
#include "server/room/room.hpp"

namespace tandem::server {

/// Timing statistics of a room's loop.
struct RoomTiming {
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  ///< number of steps finished after the next deadline (kFaultOverrun)
  std::uint64_t missed = 0;    ///< number of skipped deadlines
  std::uint64_t slow = 0;      ///< number of steps for which the room counted as slow (kFaultRoomSlow)
  Histogram lateness;          ///< delay from the deadline to the start of a step
  /// Duration of a whole step: the answer, the calls after the answer, and finish(). Work for other rooms between these
  /// parts is excluded.
  Histogram step_time;
};

/// Steps each room at the deadlines of its period.
///
/// * Shared threads: small rooms share threads, one per core. The deadlines of the rooms of a thread follow one after
///   the other, so that the thread steps several rooms before it sleeps again.
/// * Separate threads: a room gets a thread of its own (room_placement.hpp) in three cases: it needs much of a core;
///   its steps are long compared with the periods of other rooms; or all users have left, because the reset of its
///   scene may take long. A room without users sleeps.
/// * Steps: a step is answered at its deadline (Room::answer()). It is finished (Room::finish()) when no other room of
///   the thread is about to be due.
/// * Priorities: all room threads run at one SCHED_FIFO priority. The io thread (io) has a lower or a higher one:
///   - Lower, while the mean steps of the rooms of each thread together take at most 250 us. Then io does not interrupt
///     a step.
///   - Higher, if the steps of some thread take longer, or if the server has only one core. Otherwise all other rooms
///     would wait for io. share() decides this.
///   - Higher at once, after two consecutive steps of more than 500 us in one room.
///   - A higher priority lasts for at least 100 ms.
/// * Overload: if the rooms together need more than the cores provide, some rooms lose their real-time priority
///   (share_realtime()). Only the users of these rooms are delayed. The rooms regain the priority after a second within
///   the limit.
class RoomScheduler {
 public:
  /// In      realtime_priority  1–98; 0: the normal scheduler
  ///         before_news        called at the start of a step with the time at which its result is expected
  ///         after_answer       called with the deadline of the step when its result is ready, before finish()
  ///         on_news            called when one or more rooms have new states to send
  ///         help_to_send       sends updates of a room in parallel with io, which waits for this call to return
  ///         All four functions are called on the room's thread. The first three must not lock or wait.
  RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority, std::function<void(LocalTime)> before_news,
                std::function<void(const Room&, LocalTime)> after_answer, std::function<void()> on_news,
                std::function<void(const Room&)> help_to_send);
  /// Stops the threads.
  ~RoomScheduler();
  RoomScheduler(const RoomScheduler&) = delete;
  RoomScheduler& operator=(const RoomScheduler&) = delete;

  /// Starts the threads. The calling thread becomes the io thread, with a priority one above theirs at first. Returns
  /// the real-time requests that the system has not granted, without duplicates.
  std::vector<std::string> start();
  void stop();
  /// Measures the load of io and of each room, then reassigns rooms and real-time priority. Has an effect at most every
  /// 25 ms.
  /// Thread  io
  void share(LocalTime now);
  /// Returns lines for the operator: one for each room that has become too slow, or keeps its rate again, since the
  /// last call.
  /// Thread  io
  std::vector<std::string> news();
  /// Timings of the rooms, in their order. Call after stop().
  std::vector<RoomTiming> timings() const;
  /// Timings of the running rooms, up to 0.1 s old. Does not block the rooms.
  /// Thread  any, but always the same one
  std::vector<RoomTiming> newest_timings();
  /// Returns the time of the last iteration of the room's loop, in which it made a step or found no users. Thread: any.
  LocalTime went_round(std::size_t room) const;

 private:
  struct Loop;
  struct Stepper;
  void run(Stepper& stepper);
  void hand_over(Stepper& stepper);
  void check_for_users(Stepper& stepper, LocalTime now);
  void notify(Stepper& stepper);
  void answer(Stepper& stepper, Loop& loop);
  void finish(Stepper& stepper, Loop& loop);
  void keep_rate(Loop& loop, LocalTime now);
  static void settle(const Stepper& stepper, Loop& loop);
  static void publish(Loop& loop);
  void measure(LocalTime now, Duration window);
  void give_priority(LocalTime now);
  void give_io_priority(LocalTime now);
  void raise_io_priority(LocalTime now);
  void place(LocalTime now);

  int realtime_priority_;
  std::function<void(LocalTime)> before_news_;
  std::function<void(const Room&, LocalTime)> after_answer_;
  std::function<void()> on_news_;
  std::function<void(const Room&)> help_to_send_;
  std::size_t cores_ = realtime::usable_cores();
  std::vector<std::unique_ptr<Loop>> loops_;
  /// shared threads, followed by one for each room
  std::vector<std::unique_ptr<Stepper>> steppers_;
  std::size_t workers_ = 0;  ///< number of shared threads
  std::atomic<bool> has_realtime_{false};
  pthread_t io_thread_{};
  std::atomic<bool> io_waits_{false};  ///< whether the io thread's priority is lower than the rooms'
  std::atomic<LocalTime> io_first_at_{LocalTime{}};
  double io_demand_ = 0;  ///< demand of the io thread, as a fraction of a core
  std::atomic<bool> is_io_busy_{false};
  std::atomic<std::size_t> stepping_{0};  ///< number of threads that are answering a step
  Duration io_cpu_{0};
  LocalTime shared_{};
  std::atomic<bool> is_stopping_{false};
};

}  // namespace tandem::server
