#include "server/net/room_scheduler.hpp"

#include <algorithm>
#include <future>
#include <set>

namespace tandem::server {

/// One room's timer and measurements; touched by its worker only while that runs.
struct RoomScheduler::Loop {
  explicit Loop(Room& its_room) : room(its_room) {}

  Room& room;
  std::unique_ptr<realtime::PeriodicTimer> timer;
  LocalTime next{};  ///< the timer's next deadline
  RoomTiming timing;
};

struct RoomScheduler::Worker {
  std::vector<Loop*> loops;
  std::promise<std::vector<std::string>> not_granted;
  std::thread thread;
};

RoomScheduler::RoomScheduler(std::vector<Room*> rooms, realtime::RealtimeRequest realtime,
                             std::function<void(const Room&)> after_step)
    : realtime_(realtime), after_step_(std::move(after_step)) {
  const std::size_t cores = std::max(2U, std::thread::hardware_concurrency());
  for (Room* room : rooms) loops_.push_back(std::make_unique<Loop>(*room));
  for (std::size_t i = 0; i < std::min(cores - 1, loops_.size()); ++i) workers_.push_back(std::make_unique<Worker>());
  for (std::size_t i = 0; i < loops_.size(); ++i) workers_[i % workers_.size()]->loops.push_back(loops_[i].get());
}

RoomScheduler::~RoomScheduler() {
  stop();
}

std::vector<std::string> RoomScheduler::start() {
  for (const auto& worker : workers_) worker->thread = std::thread([this, &worker = *worker] { run(worker); });
  std::set<std::string> lines;
  for (const auto& worker : workers_) {
    for (std::string& line : worker->not_granted.get_future().get()) lines.insert(std::move(line));
  }
  return {lines.begin(), lines.end()};
}

void RoomScheduler::stop() {
  is_stopping_.store(true, std::memory_order_relaxed);
  for (const auto& worker : workers_) {
    if (worker->thread.joinable()) worker->thread.join();
  }
}

void RoomScheduler::run(Worker& worker) {
  worker.not_granted.set_value(realtime::request_realtime(realtime_));
  const LocalTime start = SteadyClock().now();
  for (Loop* loop : worker.loops) {
    loop->timer = std::make_unique<realtime::PeriodicTimer>(loop->room.period(), start);
    loop->next = start;
  }
  while (!is_stopping_.load(std::memory_order_relaxed)) step_next(worker);
}

void RoomScheduler::step_next(Worker& worker) {
  Loop& loop = **std::min_element(worker.loops.begin(), worker.loops.end(),
                                  [](const Loop* a, const Loop* b) { return a->next < b->next; });
  const LocalTime deadline = loop.timer->wait();
  loop.next = deadline + loop.room.period();
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  loop.room.step(server_time_of_own_clock(begin));
  const LocalTime end = clock.now();
  loop.timing.step_time.record(end - begin);
  ++loop.timing.steps;
  if (end > loop.next) {
    ++loop.timing.overruns;
    loop.room.report(kFaultOverrun);
  }
  after_step_(loop.room);
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
