#include "server/net/room_scheduler.hpp"

#include <algorithm>
#include <future>
#include <set>
#include <thread>
#include <utility>

#include "common/realtime/mailbox.hpp"
#include "common/realtime/rate_watch.hpp"
#include "server/net/realtime_share.hpp"

namespace tandem::server {
namespace {

/// How often an empty room looks whether somebody has come.
constexpr Duration kLookAgain = std::chrono::milliseconds(5);
constexpr Duration kTrustedAgainAfter = std::chrono::seconds(1);
constexpr Duration kSharePeriod = std::chrono::milliseconds(25);
constexpr double kWindowsOfAMean = 10;
constexpr Duration kPublishEvery = std::chrono::milliseconds(100);
constexpr std::uint64_t kEnoughSteps = 5;

}  // namespace

/// One room's thread, timer and measurements; touched by that thread alone while it runs, but for what is atomic and the
/// mailbox.
struct RoomScheduler::Loop {
  /// `place`: 0 to 1, of its deadlines in a period.
  Loop(Room& its_room, double place)
      : room(its_room),
        phase(from_seconds(place * to_seconds(its_room.period()))),
        rate(its_room.period()),
        publish_every(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(kPublishEvery / its_room.period()))) {}

  /// Where a timer starts that is to wake within a period from now.
  LocalTime last_deadline(LocalTime now) const { return now - (now.time_since_epoch() - phase) % room.period(); }

  Room& room;
  const Duration phase;
  std::promise<std::vector<std::string>> not_granted;
  std::unique_ptr<realtime::PeriodicTimer> timer;
  realtime::RateWatch rate;
  RoomTiming timing;
  std::atomic<std::uint64_t> steps{0};
  std::atomic<LocalTime> went_round{LocalTime{}};
  std::uint64_t publish_every;  ///< steps
  realtime::Mailbox<RoomTiming> published;
  LocalTime slow_until{};  ///< counts as slow until then, if it keeps its rate so long; LocalTime{}: does not
  std::atomic<bool> is_slow{false};
  bool is_told_slow = false;  ///< io thread's
  std::thread thread;
};

/// What one thread of real-time priority needs of a core, and whether it has it.
struct RoomScheduler::Meter {
  /// At the end of a window. A room that gets less than it needs makes fewer steps: what counts is what it would use at its
  /// rate. A mean over some 250 ms: the kernel counts a second, and a hiccup is no need.
  void measure(Duration window) {
    const Duration used = realtime::cpu_time(thread) - cpu_time;
    cpu_time += used;
    double need = used / std::chrono::duration<double, std::nano>(window);
    if (loop != nullptr) {
      const std::uint64_t steps = loop->steps.load(std::memory_order_relaxed) - steps_before;
      steps_before += steps;
      const Duration at_its_rate = static_cast<Duration::rep>(steps) * loop->room.period();
      if (steps >= kEnoughSteps) need = std::max(need, used / std::chrono::duration<double, std::nano>(at_its_rate));
    }
    user.demand += (need - user.demand) / kWindowsOfAMean;
  }

  pthread_t thread{};
  const Loop* loop = nullptr;  ///< nullptr: io, which has no rate of its own
  Duration cpu_time{0};
  std::uint64_t steps_before = 0;
  RealtimeUser user{};
  LocalTime not_before{};  ///< gets no priority until then
};

RoomScheduler::RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority,
                             std::function<void(const Room&, LocalTime)> after_step)
    : realtime_priority_(realtime_priority), after_step_(std::move(after_step)) {
  for (Room* room : rooms) {
    const double place = static_cast<double>(loops_.size()) / static_cast<double>(rooms.size());
    loops_.push_back(std::make_unique<Loop>(*room, place));
  }
}

RoomScheduler::~RoomScheduler() {
  stop();
}

std::vector<std::string> RoomScheduler::start() {
  for (const auto& loop : loops_) loop->went_round.store(SteadyClock().now(), std::memory_order_relaxed);
  for (const auto& loop : loops_) loop->thread = std::thread([this, &loop = *loop] { run(loop); });
  std::set<std::string> lines;
  for (const auto& loop : loops_) {
    for (std::string& line : loop->not_granted.get_future().get()) lines.insert(std::move(line));
  }
  const int io_priority = realtime_priority_ > 0 ? realtime_priority_ + 1 : 0;
  for (std::string& line : realtime::request_realtime(io_priority)) lines.insert(std::move(line));
  if (realtime::has_realtime_priority()) {
    meters_.push_back({.thread = pthread_self(), .loop = nullptr});
    for (const auto& loop : loops_) meters_.push_back({.thread = loop->thread.native_handle(), .loop = loop.get()});
    for (Meter& meter : meters_) meter.cpu_time = realtime::cpu_time(meter.thread);
    shared_ = SteadyClock().now();
  }
  return {lines.begin(), lines.end()};
}

void RoomScheduler::stop() {
  is_stopping_.store(true, std::memory_order_relaxed);
  for (const auto& loop : loops_) {
    if (loop->thread.joinable()) loop->thread.join();
  }
}

void RoomScheduler::run(Loop& loop) {
  loop.not_granted.set_value(realtime::request_realtime(realtime_priority_));
  loop.timer = std::make_unique<realtime::PeriodicTimer>(loop.room.period(), loop.last_deadline(SteadyClock().now()));
  while (!is_stopping_.load(std::memory_order_relaxed)) {
    if (!loop.room.is_idle()) {
      step(loop);
      continue;
    }
    std::this_thread::sleep_for(kLookAgain);
    const LocalTime now = SteadyClock().now();
    loop.timer->restart(loop.last_deadline(now));
    loop.rate.restart();
    loop.went_round.store(now, std::memory_order_relaxed);
  }
}

void RoomScheduler::step(Loop& loop) {
  const LocalTime deadline = loop.timer->wait();
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  loop.room.step(server_time_of_own_clock(begin));
  const LocalTime end = clock.now();
  loop.timing.step_time.record(end - begin);
  ++loop.timing.steps;
  loop.steps.store(loop.timing.steps, std::memory_order_relaxed);
  if (end > deadline + loop.room.period()) {
    ++loop.timing.overruns;
    loop.room.report(kFaultOverrun);
  }
  keep_rate(loop, end);
  after_step_(loop.room, deadline);
  loop.went_round.store(end, std::memory_order_relaxed);
  if (loop.timing.steps % loop.publish_every == 0 || loop.room.is_idle()) publish(loop);
}

/// Some 17 KB are copied.
void RoomScheduler::publish(Loop& loop) {
  RoomTiming& timing = loop.published.back();
  timing = loop.timing;
  timing.lateness = loop.timer->lateness();
  timing.missed = loop.timer->missed();
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
  if (loop.rate.is_slow(now)) {
    loop.slow_until = now + kTrustedAgainAfter;
  } else if (now >= loop.slow_until) {
    loop.slow_until = LocalTime{};
  }
  const bool is_slow = loop.slow_until != LocalTime{};
  loop.is_slow.store(is_slow, std::memory_order_relaxed);
  if (!is_slow) return;
  ++loop.timing.slow;
  loop.room.report(kFaultRoomSlow);
}

void RoomScheduler::share(LocalTime now) {
  if (meters_.empty() || now < shared_ + kSharePeriod) return;
  const Duration window = now - std::exchange(shared_, now);
  std::vector<RealtimeUser> users;
  for (Meter& meter : meters_) {
    meter.measure(window);
    users.push_back(meter.user);
  }
  share_realtime(users, cores_);
  for (std::size_t i = 0; i < users.size(); ++i) give(meters_[i], users[i].has_priority, now);
}

/// Priority is lost at once, and gained by who has fitted for a second.
void RoomScheduler::give(Meter& meter, bool has_priority, LocalTime now) {
  if (!has_priority) meter.not_before = now + kTrustedAgainAfter;
  if (has_priority == meter.user.has_priority || (has_priority && now < meter.not_before)) return;
  meter.user.has_priority = has_priority;
  realtime::set_priority(meter.thread, has_priority ? realtime_priority_ : 0);
}

std::vector<std::string> RoomScheduler::news() {
  std::vector<std::string> lines;
  for (const auto& loop : loops_) {
    const bool is_slow = loop->is_slow.load(std::memory_order_relaxed);
    if (std::exchange(loop->is_told_slow, is_slow) == is_slow) continue;
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
    if (loop->timer == nullptr) continue;
    timings.back().lateness = loop->timer->lateness();
    timings.back().missed = loop->timer->missed();
  }
  return timings;
}

}  // namespace tandem::server
