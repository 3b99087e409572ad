// The threads that step a server's rooms.
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

/// How well a room's loop kept its time.
struct RoomTiming {
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  ///< steps that were finished after the next deadline (kFaultOverrun)
  std::uint64_t missed = 0;    ///< deadlines skipped
  std::uint64_t slow = 0;      ///< steps while it did not keep 90 % of its rate, and the second after (kFaultRoomSlow)
  Histogram lateness;          ///< of the beginning of a step
  Histogram step_time;  ///< answer, what is called after it, and the rest; not what was done for other rooms in between
};

/// Steps each room at the deadlines of its own period. Small rooms share threads, one a core, and are due there one after the other:
/// a thread that has woken up mostly steps several before it sleeps again. A room that is measured to need much of a core, whose steps are
/// long beside the periods of others, or that everybody has left (it will be made anew) has a thread of its own
/// (room_placement.hpp). A room that nobody is in sleeps. A step is answered at its deadline, and finished when no room of the
/// thread is about to be due (Room::answer(), Room::finish()).
///
/// All run at one SCHED_FIFO priority. The io thread's is below theirs while the steps of no thread take more than 250 us, so
/// that it interrupts none; above for 100 ms after two steps of 500 us of one room, because all others would wait for it. By
/// `share_realtime()` a room that is measured to be too large, or one too many, leaves that priority to the others until it has
/// fitted for a second: its own users wait, nobody else's.
class RoomScheduler {
 public:
  /// In      realtime_priority  1–98; 0: the normal scheduler
  ///         before_news        as the next two on the room's thread, without a lock or a wait: a step begins, whose answer
  ///                            is expected at that time
  ///         after_answer       with the deadline of its step, which is not finished then
  ///         on_news            of one or more rooms there are new states to send
  ///         help_to_send       those of this room, which is awaited: io does so on another processor, and waits for who helps
  RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority, std::function<void(LocalTime)> before_news,
                std::function<void(const Room&, LocalTime)> after_answer, std::function<void()> on_news,
                std::function<void(const Room&)> help_to_send);
  /// Stops.
  ~RoomScheduler();
  RoomScheduler(const RoomScheduler&) = delete;
  RoomScheduler& operator=(const RoomScheduler&) = delete;

  /// Starts the threads, and takes the calling one for io: one above them at first. Returns what was asked for and not granted, each
  /// line once.
  std::vector<std::string> start();
  void stop();
  /// Measures what io and each room need, and shares threads and the real-time priority anew; at most each 25 ms.
  /// Thread  io
  void share(LocalTime now);
  /// Rooms that have become too slow, or keep up again, since the last call; one line for people each.
  /// Thread  io
  std::vector<std::string> news();
  /// In the order of the rooms; after stop().
  std::vector<RoomTiming> timings() const;
  /// Likewise while they run, a tenth of a second old; the rooms wait for nobody.
  /// Thread  any, always the same
  std::vector<RoomTiming> newest_timings();
  /// When the loop of a room last went round: it has stepped, or found that nobody is there. Thread  any
  LocalTime went_round(std::size_t room) const;

 private:
  struct Loop;
  struct Stepper;
  void run(Stepper& stepper);
  void hand_over(Stepper& stepper);
  void look_for_users(Stepper& stepper, LocalTime now);
  void tell(Stepper& stepper);
  void answer(Stepper& stepper, Loop& loop);
  void finish(Stepper& stepper, Loop& loop);
  void keep_rate(Loop& loop, LocalTime now);
  static void settle(const Stepper& stepper, Loop& loop);
  static void publish(Loop& loop);
  void measure(LocalTime now, Duration window);
  void give_priority(LocalTime now);
  void give_io_priority(LocalTime now);
  void put_io_first(LocalTime now);
  void place(LocalTime now);

  int realtime_priority_;
  std::function<void(LocalTime)> before_news_;
  std::function<void(const Room&, LocalTime)> after_answer_;
  std::function<void()> on_news_;
  std::function<void(const Room&)> help_to_send_;
  std::size_t cores_ = realtime::usable_cores();
  std::vector<std::unique_ptr<Loop>> loops_;
  /// Those that rooms share, then one for each room.
  std::vector<std::unique_ptr<Stepper>> steppers_;
  std::size_t workers_ = 0;  ///< how many of them are shared
  std::atomic<bool> has_realtime_{false};
  pthread_t io_thread_{};
  std::atomic<bool> io_waits_{false};  ///< for steps: it has less priority than they
  std::atomic<LocalTime> io_first_at_{LocalTime{}};
  double io_demand_ = 0;  ///< share of a core
  std::atomic<bool> is_io_busy_{false};
  std::atomic<std::size_t> stepping_{0};  ///< threads that answer one
  Duration io_cpu_{0};
  LocalTime shared_{};
  std::atomic<bool> is_stopping_{false};
};

}  // namespace tandem::server
