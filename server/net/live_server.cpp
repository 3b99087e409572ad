#include "server/net/live_server.hpp"

#include <openssl/rand.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <future>
#include <set>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "common/realtime/realtime.hpp"
#include "server/net/asio_server_transport.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// Time-outs are checked at least this often, even when no room steps.
constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
/// How long stop() waits for goodbyes to be read.
constexpr Duration kStopWithin = std::chrono::seconds(1);

int open_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
  return descriptor;
}

std::uint64_t unguessable_id() {
  std::array<unsigned char, sizeof(std::uint64_t)> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("the system gives no random bytes, which connection ids need; look at /dev/urandom");
  }
  return std::bit_cast<std::uint64_t>(bytes);
}

/// The threads that step the rooms.
///
/// Rooms are dealt to at most (cores − 1) worker threads, so that one core is left for io. A worker with several
/// rooms steps the one whose deadline is next; each room keeps absolute deadlines of its own period. Workers run at
/// one SCHED_FIFO priority, below the io thread: reading a datagram takes microseconds, and a step that used the
/// datagram before it would be a millisecond older.
class RoomScheduler {
 public:
  /// `after_step` runs on a worker thread after each step: no lock, no wait.
  RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority, std::function<void(const Room&)> after_step);
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
  /// One room's timer and measurements; touched by its worker only while that runs.
  struct Loop {
    explicit Loop(Room& its_room) : room(its_room) {}

    Room& room;
    std::unique_ptr<realtime::PeriodicTimer> timer;
    LocalTime next{};  ///< the timer's next deadline
    RoomTiming timing;
  };

  struct Worker {
    std::vector<Loop*> loops;
    std::promise<std::vector<std::string>> not_granted;
    std::thread thread;
  };

  void run(Worker& worker);
  void step_next(Worker& worker);

  int realtime_priority_;
  std::function<void(const Room&)> after_step_;
  std::vector<std::unique_ptr<Loop>> loops_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::atomic<bool> is_stopping_{false};
};

RoomScheduler::RoomScheduler(const std::vector<Room*>& rooms, int realtime_priority,
                             std::function<void(const Room&)> after_step)
    : realtime_priority_(realtime_priority), after_step_(std::move(after_step)) {
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
  worker.not_granted.set_value(realtime::request_realtime(realtime_priority_));
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

}  // namespace

struct LiveServer::Impl {
  Impl(LiveServer& server, LiveServerSettings server_settings, std::vector<std::unique_ptr<Room>> server_rooms);

  std::vector<Room*> room_pointers() const;
  void run();
  void begin_stop(const std::string& why);
  void finish_when_closed(LocalTime deadline);
  void await_steps();
  void await_poll_time();
  void log(const std::string& line) const {
    if (owner.on_log) owner.on_log(line);
  }

  LiveServer& owner;
  LiveServerSettings settings;
  std::vector<std::unique_ptr<Room>> rooms;
  SteadyClock clock;
  asio::io_context io{1};
  AsioServerTransport transport;
  SessionHub hub;
  asio::posix::stream_descriptor step_event;
  RoomScheduler scheduler;
  asio::steady_timer poll_timer{io};
  asio::steady_timer duration_timer{io};
  asio::steady_timer stop_timer{io};
  asio::signal_set signals{io};
  bool is_stopping = false;
  LocalTime started{};
  LocalTime ended{};
};

LiveServer::Impl::Impl(LiveServer& server, LiveServerSettings server_settings,
                       std::vector<std::unique_ptr<Room>> server_rooms)
    : owner(server),
      settings(std::move(server_settings)),
      rooms(std::move(server_rooms)),
      transport(io, settings.bind_address, settings.port, clock),
      hub(
          [this] {
            settings.hub.datagram_port = transport.port();
            if (!settings.hub.connection_ids) settings.hub.connection_ids = unguessable_id;
            return settings.hub;
          }(),
          room_pointers(), transport),
      step_event(io, open_eventfd()),
      scheduler(room_pointers(), settings.realtime_priority,
                [this, descriptor = step_event.native_handle()](const Room& room) {
                  const std::uint64_t one = 1;
                  // Fails only when the counter is full: then the io thread has been woken already.
                  [[maybe_unused]] const auto written = ::write(descriptor, &one, sizeof one);
                  if (owner.on_step) owner.on_step(room);
                }) {
  hub.on_log = [this](const std::string& line) { log(line); };
}

std::vector<Room*> LiveServer::Impl::room_pointers() const {
  std::vector<Room*> pointers;
  for (const auto& room : rooms) pointers.push_back(room.get());
  return pointers;
}

void LiveServer::Impl::run() {
  started = clock.now();
  std::vector<std::string> not_granted = scheduler.start();
  const int io_priority = settings.realtime_priority > 0 ? settings.realtime_priority + 1 : 0;
  for (const std::string& line : realtime::request_realtime(io_priority)) {
    if (std::find(not_granted.begin(), not_granted.end(), line) == not_granted.end()) not_granted.push_back(line);
  }
  for (const std::string& line : not_granted) log(line);
  transport.serve(hub);
  await_steps();
  await_poll_time();
  if (settings.stops_on_signals) {
    signals.add(SIGINT);
    signals.add(SIGTERM);
    signals.async_wait([this](const error_code& error, int) {
      if (!error) begin_stop("stopping on a signal");
    });
  }
  if (settings.duration) {
    duration_timer.expires_after(*settings.duration);
    duration_timer.async_wait([this](const error_code& error) {
      if (!error) begin_stop("stopping after the asked duration");
    });
  }
  io.run();
  scheduler.stop();
  ended = clock.now();
}

void LiveServer::Impl::await_steps() {
  step_event.async_wait(asio::posix::stream_descriptor::wait_read, [this](const error_code& error) {
    if (error) return;
    std::uint64_t count = 0;
    [[maybe_unused]] const auto taken = ::read(step_event.native_handle(), &count, sizeof count);
    hub.poll(clock.now());
    await_steps();
  });
}

void LiveServer::Impl::await_poll_time() {
  poll_timer.expires_after(kPollPeriod);
  poll_timer.async_wait([this](const error_code& error) {
    if (error) return;
    hub.poll(clock.now());
    await_poll_time();
  });
}

void LiveServer::Impl::begin_stop(const std::string& why) {
  if (is_stopping) return;
  is_stopping = true;
  log(why);
  transport.stop_accepting();
  hub.stop(clock.now());
  finish_when_closed(clock.now() + kStopWithin);
}

void LiveServer::Impl::finish_when_closed(LocalTime deadline) {
  if (transport.open_connections() == 0 || clock.now() >= deadline) {
    io.stop();
    return;
  }
  stop_timer.expires_after(kPollPeriod);
  stop_timer.async_wait([this, deadline](const error_code&) { finish_when_closed(deadline); });
}

LiveServer::LiveServer(LiveServerSettings settings, std::vector<std::unique_ptr<Room>> rooms)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), std::move(rooms))) {}

LiveServer::~LiveServer() = default;

std::uint16_t LiveServer::port() const {
  return impl_->transport.port();
}

const std::vector<std::unique_ptr<Room>>& LiveServer::rooms() const {
  return impl_->rooms;
}

void LiveServer::run() {
  impl_->run();
}

void LiveServer::stop() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->begin_stop("stopping"); });
}

void LiveServer::abandon() {
  impl_->io.stop();
}

Duration LiveServer::up() const {
  return impl_->ended - impl_->started;
}

const HubCounters& LiveServer::counters() const {
  return impl_->hub.counters();
}

std::vector<RoomTiming> LiveServer::room_timings() const {
  return impl_->scheduler.timings();
}

}  // namespace tandem::server
