// Threads that step a server's rooms.
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
  std::uint64_t overruns = 0;  ///< steps finished after the next deadline (kFaultOverrun)
  std::uint64_t missed = 0;    ///< deadlines skipped
  std::uint64_t slow = 0;      ///< steps below 90 % of the rate, and in the second after (kFaultRoomSlow)
  Histogram lateness;          ///< delay of the start of a step
  /// Answer, calls after it, and the rest of the step, without work for other rooms in between.
  Histogram step_time;
};

/// Steps each room at the deadlines of its own period. Small rooms share threads, one per core, and are due one after
/// the other. A thread that has woken up thus usually steps several rooms before it sleeps again. A room gets a thread
/// of its own (room_placement.hpp) if it needs much of a core, or if its steps are long compared with other rooms'
/// periods. So does a room that all users have left, because its scene will be remade. A room without users sleeps. A
/// step is answered at its deadline, and finished when no room of the thread is about to be due (Room::answer(),
/// Room::finish()).
///
/// All threads run at one SCHED_FIFO priority. The io thread's priority is lower while no thread's steps take more than
/// 250 us, so that it interrupts none. It is higher for 100 ms after two steps of 500 us in one room, because all other
/// rooms would wait for io. Rooms that exceed the cores by share_realtime() lose the priority until they have fitted
/// for a second, so that only their own users wait.
class RoomScheduler {
 public:
  /// In      realtime_priority  1–98; 0: the normal scheduler
  ///         before_news        called at the start of a step with the expected time of its answer
  ///         after_answer       called with the deadline of the step, before it is finished
  ///         on_news            called when one or more rooms have new states to send
  ///         help_to_send       called to send updates of a room in parallel to io, which waits for the helper
  ///         All four are called on the room's thread, the first three without a lock or a wait.
  RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority, std::function<void(LocalTime)> before_news,
                std::function<void(const Room&, LocalTime)> after_answer, std::function<void()> on_news,
                std::function<void(const Room&)> help_to_send);
  /// Stops the threads.
  ~RoomScheduler();
  RoomScheduler(const RoomScheduler&) = delete;
  RoomScheduler& operator=(const RoomScheduler&) = delete;

  /// Starts the threads, and makes the calling thread the io thread, at first one priority above them. Returns the
  /// real-time requests that were not granted, without duplicates.
  std::vector<std::string> start();
  void stop();
  /// Measures the load of io and of each room, then reassigns threads and real-time priority; at most every 25 ms.
  /// Thread  io
  void share(LocalTime now);
  /// News about rooms that have become too slow or keep up again since the last call, one line each for the operator.
  /// Thread  io
  std::vector<std::string> news();
  /// Timings in the order of the rooms. Call after stop().
  std::vector<RoomTiming> timings() const;
  /// Timings while the rooms run, up to 0.1 s old; does not block the rooms.
  /// Thread  any, always the same
  std::vector<RoomTiming> newest_timings();
  /// Time of the room loop's last iteration: it has stepped, or found no users. Thread: any.
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
  /// Shared threads, then one for each room.
  std::vector<std::unique_ptr<Stepper>> steppers_;
  std::size_t workers_ = 0;  ///< number of shared threads
  std::atomic<bool> has_realtime_{false};
  pthread_t io_thread_{};
  std::atomic<bool> io_waits_{false};  ///< io has less priority than the steps
  std::atomic<LocalTime> io_first_at_{LocalTime{}};
  double io_demand_ = 0;  ///< share of a core
  std::atomic<bool> is_io_busy_{false};
  std::atomic<std::size_t> stepping_{0};  ///< threads that are answering a step
  Duration io_cpu_{0};
  LocalTime shared_{};
  std::atomic<bool> is_stopping_{false};
};

}  // namespace tandem::server
