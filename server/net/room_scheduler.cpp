#include "server/net/room_scheduler.hpp"

#include <algorithm>
#include <future>
#include <semaphore>
#include <set>
#include <thread>
#include <utility>

#include "common/realtime/mailbox.hpp"
#include "common/realtime/rate_watch.hpp"
#include "server/net/realtime_share.hpp"
#include "server/net/room_placement.hpp"

namespace tandem::server {
namespace {

/// Period at which empty rooms are checked for users.
constexpr Duration kUserCheckPeriod = std::chrono::milliseconds(5);
/// Approximate time to sleep and wake up. A thread spins through a shorter wait.
constexpr Duration kNotWorthASleep = std::chrono::microseconds(50);
/// Mean answer time of a room up to which io (the io thread) is woken at the start of a step. It then wakes up during
/// the step and spins until the end of the step.
constexpr Duration kWakesAheadOf = std::chrono::microseconds(100);
// Demands of the io thread, as fractions of a core (hysteresis). Above kBusyIo, the io thread is not woken after each
// short step. The states of such a step are then sent together with those of the next rooms, at most kNotifyWithin
// later. Below kNotBusyIo, the io thread is woken after each step again.
constexpr double kBusyIo = 0.6, kNotBusyIo = 0.4;
constexpr Duration kNotifyWithin = std::chrono::microseconds(60);
constexpr Duration kTrustedAgainAfter = std::chrono::seconds(1), kIoWaitsAgainAfter = std::chrono::milliseconds(100);
constexpr Duration kSharePeriod = std::chrono::milliseconds(25), kPublishEvery = std::chrono::milliseconds(100);
constexpr double kWindowsOfAMean = 10;
constexpr int kStepsOfAMean = 64;
constexpr std::uint64_t kEnoughSteps = 5;
// Bounds for a room on a shared thread (hysteresis). A room with a demand above kMaxShared, as a fraction of a core,
// leaves the shared threads. It may share a thread again below kMaxToShareAgain. The same bounds apply to the step
// time, as a fraction of the shortest period of all rooms.
constexpr double kMaxShared = 0.3, kMaxToShareAgain = 0.2;
/// Longest sleep without a check for newly assigned rooms and for new users.
constexpr Duration kLongSleep = std::chrono::milliseconds(2);
/// Number of parts of a period. The phase of a room's deadlines may deviate by one part from its computed value. A
/// larger deviation is corrected by at most one part per step.
constexpr int kPlaces = 64;
// Priority of the io thread (io). It is lower than that of the rooms while the steps of each thread together take at
// most kIoWaitsFor. It becomes higher, because all rooms depend on io, after kSlowStepsInARow consecutive steps of one
// room that take longer than kIoWaitsNotFor.
constexpr Duration kIoWaitsFor = std::chrono::microseconds(250), kIoWaitsNotFor = std::chrono::microseconds(500);
constexpr int kSlowStepsInARow = 2;

/// Cumulative time of an activity, written by one thread and read by any. begin() and end() return `now`.
class Busy {
 public:
  LocalTime begin(LocalTime now) {
    began_.store(now, std::memory_order_release);
    return now;
  }
  LocalTime end(LocalTime now) {
    const LocalTime began = began_.load(std::memory_order_relaxed);
    done_.store(done_.load(std::memory_order_relaxed) + (now - began).count(), std::memory_order_release);
    began_.store(LocalTime{}, std::memory_order_release);
    return now;
  }
  /// Returns the total time, including that of the activity in progress.
  Duration until(LocalTime now) const {
    for (;;) {
      const LocalTime began = began_.load(std::memory_order_acquire);
      const Duration done(done_.load(std::memory_order_acquire));
      if (began_.load(std::memory_order_relaxed) != began)
        // The activity has begun or ended between the two loads.
        continue;
      return began == LocalTime{} ? done : done + std::max(Duration{0}, now - began);
    }
  }

 private:
  std::atomic<LocalTime> began_{LocalTime{}};  ///< LocalTime{}: not active
  std::atomic<Duration::rep> done_{0};
};

/// Measurements by which io assigns a room to a thread. Used by the io thread only.
struct RoomLoad {
  std::uint64_t steps_before = 0;  ///< value of Loop::steps at the last measurement
  Duration busy_before{0};
  double demand = 0;  ///< fraction of a core that the room needs to keep its rate
  Duration step{0};   ///< mean step time
  LocalTime no_priority_before{}, alone_until{};
  bool is_reported_slow = false;
};

}  // namespace

/// Timer and measurements of a room. The thread that steps the room owns them, except the atomics and the mailbox.
struct RoomScheduler::Loop {
  explicit Loop(Room& its_room)
      : room(its_room),
        timer(its_room.period(), LocalTime{}),
        rate(its_room.period()),
        publish_every(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(kPublishEvery / its_room.period()))) {}

  Room& room;
  realtime::PeriodicTimer timer;
  realtime::RateWatch rate;
  RoomTiming timing;
  std::uint64_t publish_every;  ///< number of steps between two publications of the timings
  bool is_awake = false;
  Duration phase{0};   ///< phase of the deadlines within a period
  int slow_steps = 0;  ///< consecutive steps longer than kIoWaitsNotFor
  Duration mean_step{0};
  Duration mean_answer{0};   ///< part of mean_step for which users wait
  Duration mean_turn{0};     ///< mean time of answer and help with sending, which delays the thread's next rooms
  bool is_answered = false;  ///< whether answer() has run and its finish() has not
  LocalTime deadline{};      ///< deadline of the step that is_answered describes
  Duration answering{0};     ///< time of the answer and of help with sending in that step
  LocalTime slow_until{};    ///< end of the time for which the room counts as slow, even if it keeps its rate again

  std::atomic<std::size_t> stepper{0};  ///< index of the owning thread; only the owner changes it, at the handover
  std::atomic<std::size_t> wanted{0};   ///< index of the thread that should own the room; written by io
  std::atomic<std::uint64_t> steps{0};
  Busy busy;                         ///< time spent in steps of this room
  std::atomic<bool> is_left{false};  ///< whether all users have left; the reset of the scene may take long
  std::atomic<LocalTime> went_round{LocalTime{}};
  std::atomic<bool> is_slow{false};
  realtime::Mailbox<RoomTiming> published;

  std::atomic<bool> has_priority{true};  ///< whether the room has real-time priority; written by io, read by its thread
  RoomLoad load;
};

/// A thread and the rooms that it steps.
struct RoomScheduler::Stepper {
  void call() {
    is_called.store(true, std::memory_order_release);
    called.release();
  }

  std::size_t index = 0;
  double place = 0;           ///< phase of the deadlines of the thread's first room [periods]
  std::vector<Loop*> loops;   ///< rooms of the thread, in the order of their deadlines
  LocalTime users_checked{};  ///< last check for users of empty rooms
  /// Time since which new states are ready without a notification of io; LocalTime{}: there are none.
  LocalTime news_since{};
  std::atomic<bool> is_called{true};  ///< whether a room was assigned, or stop() was called
  /// The thread sleeps on this semaphore until call(). A call of try_acquire() yields the processor.
  std::counting_semaphore<> called{0};
  std::promise<std::vector<std::string>> not_granted;
  std::thread thread;
  Busy busy;  ///< time spent in steps of all rooms of this thread
  // Used by the io thread only.
  Duration cpu_before{0}, busy_before{0};  ///< values at the last measurement
  double cpu_of_busy = 1;  ///< processor time, wake-ups included, divided by busy time, in the last interval
};

RoomScheduler::RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority,
                             std::function<void(LocalTime)> before_news,
                             std::function<void(const Room&, LocalTime)> after_answer, std::function<void()> on_news,
                             std::function<void(const Room&)> help_to_send)
    : realtime_priority_(realtime_priority),
      before_news_(std::move(before_news)),
      after_answer_(std::move(after_answer)),
      on_news_(std::move(on_news)),
      help_to_send_(std::move(help_to_send)),
      workers_(std::min(cores_, rooms.size())) {
  for (Room* room : rooms) {
    loops_.push_back(std::make_unique<Loop>(*room));
    const std::size_t worker = (loops_.size() - 1) % workers_;
    loops_.back()->stepper.store(worker, std::memory_order_relaxed);
    loops_.back()->wanted.store(worker, std::memory_order_relaxed);
  }
  for (std::size_t i = 0; i < workers_ + rooms.size(); ++i) {
    steppers_.push_back(std::make_unique<Stepper>());
    steppers_[i]->index = i;
    // The phase of the thread is the middle of its part of a period. Its deadlines thus avoid whole milliseconds, at
    // which the kernel's tick takes about 30 us.
    const std::size_t number = i < workers_ ? i : i - workers_, of = i < workers_ ? workers_ : rooms.size();
    steppers_[i]->place = (static_cast<double>(number) + 0.5) / static_cast<double>(of);
    steppers_[i]->loops.reserve(rooms.size());
  }
}

RoomScheduler::~RoomScheduler() {
  stop();
}

std::vector<std::string> RoomScheduler::start() {
  for (const auto& loop : loops_) loop->went_round.store(SteadyClock().now(), std::memory_order_relaxed);
  for (const auto& stepper : steppers_) stepper->thread = std::thread([this, &stepper = *stepper] { run(stepper); });
  std::set<std::string> lines;
  for (const auto& stepper : steppers_) {
    for (std::string& line : stepper->not_granted.get_future().get()) lines.insert(std::move(line));
  }
  const int io_priority = realtime_priority_ > 0 ? realtime_priority_ + 1 : 0;
  io_thread_ = pthread_self();
  for (std::string& line : realtime::request_realtime(io_priority)) lines.insert(std::move(line));
  has_realtime_ = realtime::has_realtime_priority();
  io_cpu_ = realtime::cpu_time(pthread_self());
  shared_ = SteadyClock().now();
  return {lines.begin(), lines.end()};
}

void RoomScheduler::stop() {
  is_stopping_.store(true, std::memory_order_relaxed);
  for (const auto& stepper : steppers_) stepper->call();
  for (const auto& stepper : steppers_) {
    if (stepper->thread.joinable()) stepper->thread.join();
  }
}

void RoomScheduler::run(Stepper& stepper) {
  stepper.not_granted.set_value(realtime::request_realtime(realtime_priority_));
  while (!is_stopping_.load(std::memory_order_relaxed)) {
    hand_over(stepper);
    // stop() releases the semaphore only once. hand_over() may have consumed that release, so is_stopping_ is checked
    // again.
    if (is_stopping_.load(std::memory_order_relaxed)) break;
    if (stepper.loops.empty()) {
      notify(stepper);
      stepper.called.acquire();
      continue;
    }
    const LocalTime now = SteadyClock().now();
    check_for_users(stepper, now);
    Loop* next = nullptr;
    for (Loop* loop : stepper.loops) {
      if (loop->is_awake && (next == nullptr || loop->timer.due() < next->timer.due())) next = loop;
    }
    const Duration time = next != nullptr ? next->timer.due() - now : Duration::max();
    if (time > kNotWorthASleep) notify(stepper);
    const auto answered = std::ranges::find_if(stepper.loops, &Loop::is_answered);
    if (answered != stepper.loops.end() &&
        time > std::max(kNotWorthASleep, (*answered)->mean_step - (*answered)->mean_turn)) {
      finish(stepper, **answered);
    } else if (time <= kLongSleep) {
      answer(stepper, *next);
    } else {
      stepper.called.try_acquire_for(std::min(time - kLongSleep / 2, kUserCheckPeriod));
    }
  }
  for (Loop* loop : stepper.loops) finish(stepper, *loop);
}

/// Hands over rooms that are assigned to other threads, and accepts newly assigned ones.
void RoomScheduler::hand_over(Stepper& stepper) {
  for (Loop* loop : stepper.loops) {
    if (loop->wanted.load(std::memory_order_relaxed) != stepper.index) finish(stepper, *loop);
  }
  std::erase_if(stepper.loops, [&](Loop* loop) {
    const std::size_t wanted = loop->wanted.load(std::memory_order_relaxed);
    if (wanted == stepper.index || loop->is_answered) return false;
    loop->stepper.store(wanted, std::memory_order_release);
    steppers_[wanted]->call();
    return true;
  });
  if (!stepper.is_called.load(std::memory_order_relaxed) || !stepper.is_called.exchange(false)) return;
  for (const auto& loop : loops_) {
    if (loop->stepper.load(std::memory_order_acquire) != stepper.index) continue;
    if (std::ranges::find(stepper.loops, loop.get()) == stepper.loops.end()) stepper.loops.push_back(loop.get());
  }
}

void RoomScheduler::check_for_users(Stepper& stepper, LocalTime now) {
  if (now < stepper.users_checked + kUserCheckPeriod) return;
  stepper.users_checked = now;
  for (Loop* loop : stepper.loops) {
    if (loop->is_awake) continue;
    loop->went_round.store(now, std::memory_order_relaxed);
    loop->is_awake = !loop->room.is_idle();
    if (!loop->is_awake) continue;
    loop->rate.restart();
    loop->timer.restart(now - (now.time_since_epoch() - loop->phase) % loop->room.period());
  }
}

void RoomScheduler::notify(Stepper& stepper) {
  if (std::exchange(stepper.news_since, LocalTime{}) != LocalTime{}) on_news_();
}

void RoomScheduler::answer(Stepper& stepper, Loop& loop) {
  finish(stepper, loop);
  loop.deadline = loop.timer.wait(kNotWorthASleep);
  const LocalTime begin = stepper.busy.begin(loop.busy.begin(SteadyClock().now()));
  // Waking io costs time. The cost is accepted if the answer takes long on average, or if io is not busy.
  const bool is_worth_it = loop.mean_answer >= kNotWorthASleep || !is_io_busy_.load(std::memory_order_relaxed);
  const bool notifies_at_once = cores_ > 1 && is_worth_it;
  // If all cores are busy with steps, io would take a core from a step and delay its end.
  const bool has_free_core = stepping_.fetch_add(1, std::memory_order_relaxed) + 1 < cores_;
  const bool wakes_io = notifies_at_once && has_free_core && loop.mean_answer < kWakesAheadOf;
  if (wakes_io) before_news_(begin + loop.mean_answer);
  loop.room.answer(server_time_of_own_clock(begin));
  const LocalTime now = SteadyClock().now();
  after_answer_(loop.room, std::min(loop.deadline, begin));
  if (stepper.news_since == LocalTime{}) stepper.news_since = now;
  if (notifies_at_once || now + loop.mean_answer - stepper.news_since >= kNotifyWithin) notify(stepper);
  // The room thread helps io to send, because otherwise the users of the next room would wait for these sends. If every
  // core is answering a step, io may have no core, and the room thread would wait for io in vain.
  const bool may_help = wakes_io && stepping_.load(std::memory_order_relaxed) < cores_ && loop.has_priority;
  if (may_help && has_realtime_.load(std::memory_order_relaxed)) help_to_send_(loop.room);
  stepping_.fetch_sub(1, std::memory_order_relaxed);
  loop.is_answered = true;
  loop.answering = stepper.busy.end(loop.busy.end(SteadyClock().now())) - begin;
  loop.mean_answer += (now - begin - loop.mean_answer) / kStepsOfAMean;
  loop.mean_turn += (loop.answering - loop.mean_turn) / kStepsOfAMean;
}

/// Runs the second part of a step, Room::finish(). No user waits for its result.
void RoomScheduler::finish(Stepper& stepper, Loop& loop) {
  if (!loop.is_answered) return;
  const LocalTime begin = stepper.busy.begin(loop.busy.begin(SteadyClock().now()));
  loop.room.finish();
  const LocalTime end = stepper.busy.end(loop.busy.end(SteadyClock().now()));
  loop.is_answered = false;
  const Duration step = loop.answering + (end - begin);
  loop.timing.step_time.record(step);
  ++loop.timing.steps;
  if (end > loop.deadline + loop.room.period()) {
    ++loop.timing.overruns;
    loop.room.report(kFaultOverrun);
  }
  keep_rate(loop, end);
  // A single slow step is usually caused by the operating system, so only consecutive slow steps raise the priority of
  // io.
  loop.slow_steps = step > kIoWaitsNotFor ? loop.slow_steps + 1 : 0;
  if (has_realtime_.load(std::memory_order_relaxed) && loop.slow_steps >= kSlowStepsInARow) raise_io_priority(end);
  loop.steps.store(loop.timing.steps, std::memory_order_relaxed);
  loop.went_round.store(end, std::memory_order_relaxed);
  loop.mean_step += (step - loop.mean_step) / kStepsOfAMean;
  settle(stepper, loop);
  loop.is_awake = !loop.room.is_idle();
  loop.is_left.store(loop.is_awake && loop.room.is_empty(), std::memory_order_relaxed);
  if (loop.timing.steps % loop.publish_every == 0 || !loop.is_awake) publish(loop);
}

/// Shifts the deadlines of a room gradually, until each deadline follows shortly after the answers of the rooms that
/// precede it on the thread.
void RoomScheduler::settle(const Stepper& stepper, Loop& loop) {
  const Duration period = loop.room.period();
  Duration all{0};
  Duration::rep count = 0;
  for (const Loop* one : stepper.loops) {
    if (!one->is_awake) continue;
    all += one->mean_step;
    ++count;
  }
  // Gaps separate the answers of the rooms, so that a longer step does not delay all other rooms. The gaps together
  // take half of the unused period, and the other half stays free at the end of the period. A single gap is at most
  // half of the answer time, and at most kNotWorthASleep.
  const Duration spare = std::max(Duration{0}, period - all) / std::max<Duration::rep>(1, 2 * count);
  Duration place = from_seconds(stepper.place * to_seconds(period));
  for (const Loop* before : stepper.loops) {
    if (before == &loop) break;
    if (before->is_awake) place += before->mean_turn + std::min({before->mean_turn / 2, kNotWorthASleep, spare});
  }
  // The difference is wrapped to the range −½ to ½ of a period.
  const Duration off = ((place - loop.phase) % period + period + period / 2) % period - period / 2;
  const Duration most = period / kPlaces;
  if (off <= most && off >= -most) return;
  const Duration later = std::clamp(off, -most, most);
  loop.phase = (loop.phase + later + period) % period;
  loop.timer.shift(later);
}

/// Publishes the timings of a room, a copy of about 17 KB.
void RoomScheduler::publish(Loop& loop) {
  RoomTiming& timing = loop.published.back() = loop.timing;
  timing.lateness = loop.timer.lateness();
  timing.missed = loop.timer.missed();
  loop.published.publish();
}

std::vector<RoomTiming> RoomScheduler::newest_timings() {
  std::vector<RoomTiming> timings;
  for (const auto& loop : loops_) {
    loop->published.poll();
    timings.push_back(loop->published.front());
  }
  return timings;
}

LocalTime RoomScheduler::went_round(std::size_t room) const {
  return loops_[room]->went_round.load(std::memory_order_relaxed);
}

void RoomScheduler::keep_rate(Loop& loop, LocalTime now) {
  if (loop.rate.is_slow(now)) loop.slow_until = now + kTrustedAgainAfter;
  loop.is_slow.store(now < loop.slow_until, std::memory_order_relaxed);
  if (now >= loop.slow_until) return;
  ++loop.timing.slow;
  loop.room.report(kFaultRoomSlow);
}

void RoomScheduler::share(LocalTime now) {
  if (loops_.empty() || now < shared_ + kSharePeriod) return;
  measure(now, now - std::exchange(shared_, now));
  if (has_realtime_) {
    give_priority(now);
    give_io_priority(now);
  }
  place(now);
}

/// Measures the demands of the rooms and of io, as means over about 250 ms, so that a short disturbance does not count.
/// * A room that lacks time makes fewer steps, so its demand is extrapolated to its full rate.
/// * A thread's processor time, wake-ups included, is divided among its rooms in proportion to their busy time.
void RoomScheduler::measure(LocalTime now, Duration window) {
  const auto share_of = [](Duration part, Duration whole) {
    return whole > Duration{0} ? std::max(0.0, part / std::chrono::duration<double, std::nano>(whole)) : 0;
  };
  const Duration io_cpu = realtime::cpu_time(pthread_self());
  io_demand_ += (share_of(io_cpu - std::exchange(io_cpu_, io_cpu), window) - io_demand_) / kWindowsOfAMean;
  is_io_busy_.store(io_demand_ > (is_io_busy_ ? kNotBusyIo : kBusyIo), std::memory_order_relaxed);
  for (const auto& stepper : steppers_) {
    const Duration cpu = realtime::cpu_time(stepper->thread.native_handle()), busy = stepper->busy.until(now);
    const Duration busy_lately = busy - std::exchange(stepper->busy_before, busy);
    const double cpu_of_busy = share_of(cpu - std::exchange(stepper->cpu_before, cpu), busy_lately);
    stepper->cpu_of_busy = busy_lately > Duration{0} ? cpu_of_busy : 1;
  }
  for (const auto& loop : loops_) {
    const std::uint64_t all_steps = loop->steps.load(std::memory_order_relaxed);
    const std::uint64_t steps = all_steps - std::exchange(loop->load.steps_before, all_steps);
    const Duration all_busy = loop->busy.until(now);
    const Duration busy = std::max(Duration{0}, all_busy - std::exchange(loop->load.busy_before, all_busy));
    const Duration at_its_rate = static_cast<Duration::rep>(steps) * loop->room.period();
    const double load = share_of(busy, steps >= kEnoughSteps ? std::min(window, at_its_rate) : window);
    const double cpu_of_busy = steppers_[loop->stepper.load(std::memory_order_relaxed)]->cpu_of_busy;
    loop->load.demand += (load * cpu_of_busy - loop->load.demand) / kWindowsOfAMean;
    const Duration step = busy / std::max<Duration::rep>(1, static_cast<Duration::rep>(steps));
    loop->load.step += (step - loop->load.step) / static_cast<Duration::rep>(kWindowsOfAMean);
  }
}

/// Withdraws real-time priority from a room at once, and restores it after the room has been within the limit for a
/// second. This concerns only rooms with separate threads: shared threads always have priority, and a room without
/// priority is not moved to a shared thread.
void RoomScheduler::give_priority(LocalTime now) {
  std::vector<double> demands{io_demand_};
  std::vector<bool> have_priority{true};
  for (const auto& loop : loops_) {
    demands.push_back(loop->load.demand);
    have_priority.push_back(loop->has_priority);
  }
  share_realtime(demands, have_priority, cores_);
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    Loop& loop = *loops_[i];
    const bool has_priority = have_priority[i + 1];
    if (!has_priority) loop.load.no_priority_before = now + kTrustedAgainAfter;
    if (has_priority == loop.has_priority || (has_priority && now < loop.load.no_priority_before)) continue;
    loop.has_priority = has_priority;
    realtime::set_priority(steppers_[workers_ + i]->thread.native_handle(), has_priority ? realtime_priority_ : 0);
  }
}

/// Gives io a lower priority than the rooms while their steps are short. With a higher priority, io would often preempt
/// a step, which would then continue on another core about 40 us later.
void RoomScheduler::give_io_priority(LocalTime now) {
  std::vector<Duration> steps(steppers_.size());
  for (const auto& loop : loops_) {
    if (loop->has_priority) steps[loop->stepper.load(std::memory_order_relaxed)] += loop->load.step;
  }
  if (cores_ < 2 || std::ranges::max(steps) > kIoWaitsFor) return raise_io_priority(now);
  if (now < io_first_at_.load(std::memory_order_relaxed) + kIoWaitsAgainAfter || io_waits_.exchange(true)) return;
  realtime::set_priority(io_thread_, std::max(1, realtime_priority_ - 1));
}

/// Gives io a higher priority than the rooms. Rooms call this as well, because io cannot run while they use all
/// processors.
/// Thread  io, rooms
void RoomScheduler::raise_io_priority(LocalTime now) {
  io_first_at_.store(now, std::memory_order_relaxed);
  io_waits_.store(false, std::memory_order_relaxed);
  // The priority is set even if it seems to be raised already. Otherwise io might be about to lower it, and could then
  // not run to raise it again.
  realtime::set_priority(io_thread_, realtime_priority_ + 1);
}

/// Assigns rooms to threads. If periods differ, a step of a room with a longer period must be short compared with the
/// shortest period.
void RoomScheduler::place(LocalTime now) {
  Duration shortest = Duration::max();
  for (const auto& loop : loops_) shortest = std::min(shortest, loop->room.period());
  std::vector<double> loads;
  std::vector<std::optional<std::size_t>> workers;
  for (const auto& loop : loops_) {
    const std::size_t stepper = loop->wanted.load(std::memory_order_relaxed);
    const bool shares = stepper < workers_;
    const double most = shares ? kMaxShared : kMaxToShareAgain;
    const bool is_of_shortest = loop->room.period() == shortest;
    const bool is_short = loop->load.step <= (is_of_shortest ? shortest : from_seconds(most * to_seconds(shortest)));
    const bool is_small = loop->load.demand <= most && is_short && !loop->is_left.load(std::memory_order_relaxed);
    if (!is_small || !loop->has_priority) loop->load.alone_until = now + kTrustedAgainAfter;
    loads.push_back(now >= loop->load.alone_until ? loop->load.demand : kSharesWithNobody);
    workers.push_back(shares ? std::optional(stepper) : std::nullopt);
  }
  place_rooms(loads, workers, workers_);
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    loops_[i]->wanted.store(workers[i].value_or(workers_ + i), std::memory_order_relaxed);
  }
}

std::vector<std::string> RoomScheduler::news() {
  std::vector<std::string> lines;
  for (const auto& loop : loops_) {
    const bool is_slow = loop->is_slow.load(std::memory_order_relaxed);
    if (std::exchange(loop->load.is_reported_slow, is_slow) == is_slow) continue;
    const std::string room = "room " + loop->room.name();
    lines.push_back(is_slow
                        ? room +
                              " steps at less than 90 % of its rate: its users feel no force; fewer bodies, contacts "
                              "or atoms, a lower step_rate_hz, fewer rooms or a faster machine would help"
                        : room + " keeps its rate again");
  }
  return lines;
}

std::vector<RoomTiming> RoomScheduler::timings() const {
  std::vector<RoomTiming> timings;
  for (const auto& loop : loops_) {
    timings.push_back(loop->timing);
    timings.back().lateness = loop->timer.lateness();
    timings.back().missed = loop->timer.missed();
  }
  return timings;
}

}  // namespace tandem::server
