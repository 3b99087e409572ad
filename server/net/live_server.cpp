#include "server/net/live_server.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <exception>
#include <stdexcept>
#include <system_error>

#include "common/realtime/mailbox.hpp"
#include "server/net/asio_server_transport.hpp"
#include "server/net/room_scheduler.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// Period after which time-outs are checked, even if no room steps.
constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
constexpr Duration kMetricsPeriod = std::chrono::milliseconds(100);
/// Approximate time to read the datagrams of kUsersAtOnce users. The io thread does not begin to read if new states are
/// expected within this time, or are late by less than this time.
constexpr Duration kReading = std::chrono::microseconds(25);
/// Limits of stop(): time for unanswered pose requests to complete, and time for clients to read the goodbye message.
constexpr Duration kAnswerWithin = std::chrono::milliseconds(400), kStopWithin = std::chrono::seconds(1);

int open_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
  return descriptor;
}

/// Returns whether the process ignores the signal; SIGHUP is ignored under nohup.
bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

struct LiveServer::Impl {
  Impl(LiveServer& server, LiveServerSettings server_settings, ServerRooms server_rooms);

  std::vector<Room*> room_pointers() const;
  void run();
  void serve();
  void begin_stop(const std::string& why);
  void send_goodbye_when_answered(LocalTime deadline);
  void finish_when_closed(LocalTime deadline);
  void wake();
  void run_cycle();
  void poll();
  void await_steps();
  void await_poll_time();
  void publish_figures();
  void report_slow_rooms();
  void log(const std::string& line) const {
    if (owner.on_log) owner.on_log("server", line);
  }

  LiveServer& owner;
  LiveServerSettings settings;
  ServerRooms served;
  const std::vector<std::unique_ptr<Room>>& rooms = served.rooms();
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
  std::atomic<bool> has_news{false};                    ///< whether unsent states are ready
  std::atomic<LocalTime> expects_news_at{LocalTime{}};  ///< expected time of new states
  std::atomic<bool> sleeps{false};                      ///< whether the io thread sleeps, or is about to sleep
  // Published for other threads.
  std::atomic<bool> is_serving{false}, is_stopping{false};
  std::atomic<LocalTime> io_went_round{LocalTime{}};
  std::atomic<std::size_t> users{0};
  realtime::Mailbox<ServerFigures> figures;
  LocalTime published{};
  LocalTime started{};
  LocalTime ended{};
};

LiveServer::Impl::Impl(LiveServer& server, LiveServerSettings server_settings, ServerRooms server_rooms)
    : owner(server),
      settings(std::move(server_settings)),
      served(std::move(server_rooms)),
      transport(io, settings.bind_address, settings.port, clock, settings.tls.get()),
      hub(
          [this] {
            if (!settings.hub.connection_ids) settings.hub.connection_ids = secure::random_u64;
            return settings.hub;
          }(),
          room_pointers(), transport),
      step_event(io, open_eventfd()),
      scheduler(
          room_pointers(), settings.realtime_priority,
          [this](LocalTime expected) {
            expects_news_at.store(expected);
            wake();
          },
          [this](const Room& room, LocalTime deadline) {
            if (owner.on_step) owner.on_step(room, deadline);
          },
          [this] {
            // The io thread loads expects_news_at first and has_news second; here they are stored in the reverse order.
            // If the io thread still reads the old has_news, it has therefore read the old expected time, too, and
            // stays awake.
            has_news.store(true);
            expects_news_at.store(LocalTime{});
            wake();
          },
          [this](const Room& room) { hub.help(room); }),
      figures({.users = std::vector<std::array<std::size_t, 3>>(rooms.size())}) {
  hub.on_log = [this](std::string_view kind, const std::string& line) {
    if (owner.on_log) owner.on_log(kind, line);
  };
  if (!settings.stops_on_signals) return;
  // Signals are handled from now on, so that a client that connects before run() also gets a goodbye message.
  signals.add(SIGINT);
  signals.add(SIGTERM);
  if (!is_ignored(SIGHUP)) signals.add(SIGHUP);
}

std::vector<Room*> LiveServer::Impl::room_pointers() const {
  std::vector<Room*> pointers;
  for (const auto& room : rooms) pointers.push_back(room.get());
  return pointers;
}

/// Serves, then stops the rooms, then finishes the services, which read the rooms. The order also holds if serve()
/// throws.
void LiveServer::Impl::run() {
  std::exception_ptr fault;
  started = clock.now();
  try {
    serve();
  } catch (...) {
    fault = std::current_exception();
  }
  scheduler.stop();
  ended = clock.now();
  try {
    served.finish();
  } catch (...) {
    if (fault == nullptr) fault = std::current_exception();
  }
  if (fault != nullptr) std::rethrow_exception(fault);
}

void LiveServer::Impl::serve() {
  io_went_round.store(started, std::memory_order_relaxed);
  for (const std::string& line : scheduler.start()) log(line);
  transport.serve(hub);
  await_steps();
  await_poll_time();
  is_serving.store(true, std::memory_order_release);
  if (settings.stops_on_signals) {
    signals.async_wait([this](const error_code& error, int) {
      if (!error) begin_stop("stopping on a signal");
    });
  }
  if (settings.duration) {
    duration_timer.expires_after(*settings.duration);
    duration_timer.async_wait([this](const error_code& error) {
      if (!error) begin_stop("stopping after the requested duration");
    });
  }
  run_cycle();
}

/// Wakes the io thread if it sleeps. An awake io thread checks for new states before it sleeps. Thread: any.
void LiveServer::Impl::wake() {
  if (!sleeps.load()) return;
  const std::uint64_t one = 1;
  // Writing fails only if the counter is full. In this case the io thread has already been woken.
  [[maybe_unused]] const auto written = ::write(step_event.native_handle(), &one, sizeof one);
}

/// Replaces io_context::run(). New states are sent with low latency by three rules:
/// 1. The thread checks for new states before it sleeps. Rooms wake it only while it sleeps.
/// 2. If a step will be short, its room wakes the thread at the start of the step. The thread is then awake when the
///    new state is ready.
/// 3. Between two checks, only the datagrams of a few users are read.
void LiveServer::Impl::run_cycle() {
  bool has_read = false;
  while (!io.stopped()) {
    const LocalTime expected = expects_news_at.load();
    if (has_news.exchange(false)) {
      poll();
      has_read = false;
    }
    const Duration until_news = expected - clock.now();
    const bool stays_awake = until_news > -kReading;
    if (has_read && stays_awake && until_news < kReading) continue;
    const bool may_have_more = transport.read_some_users();
    has_read = true;
    if (io.poll_one() > 0 || may_have_more || stays_awake) continue;
    sleeps.store(true);
    if (!has_news.load() && expects_news_at.load() + kReading <= clock.now()) io.run_one();
    sleeps.store(false);
  }
}

void LiveServer::Impl::poll() {
  hub.poll(clock);
  transport.begin_turn();
}

void LiveServer::Impl::await_steps() {
  step_event.async_wait(asio::posix::stream_descriptor::wait_read, [this](const error_code& error) {
    if (error) return;
    std::uint64_t count = 0;
    [[maybe_unused]] const auto taken = ::read(step_event.native_handle(), &count, sizeof count);
    await_steps();
  });
}

void LiveServer::Impl::await_poll_time() {
  poll_timer.expires_after(kPollPeriod);
  poll_timer.async_wait([this](const error_code& error) {
    if (error) return;
    poll();
    scheduler.share(clock.now());
    report_slow_rooms();
    publish_figures();
    await_poll_time();
  });
}

void LiveServer::Impl::publish_figures() {
  const LocalTime now = clock.now();
  io_went_round.store(now, std::memory_order_relaxed);
  if (now < published + kMetricsPeriod) return;
  published = now;
  users.store(hub.user_count(), std::memory_order_relaxed);
  ServerFigures& newest = figures.back();
  newest.hub = hub.counters();
  newest.failed_handshakes = transport.failed_handshakes();
  newest.connections = transport.open_connections();
  for (std::size_t i = 0; i < rooms.size(); ++i) newest.users[i] = hub.users_in(i);
  figures.publish();
}

void LiveServer::Impl::report_slow_rooms() {
  for (const std::string& line : scheduler.news())
    if (owner.on_log) owner.on_log("rate", line);
}

void LiveServer::Impl::begin_stop(const std::string& why) {
  if (is_stopping.exchange(true)) return;
  log(why);
  transport.stop_accepting();
  hub.begin_stop();
  send_goodbye_when_answered(clock.now() + kAnswerWithin);
}

void LiveServer::Impl::send_goodbye_when_answered(LocalTime deadline) {
  hub.poll(clock);
  if (!hub.owes_answers() || clock.now() >= deadline) {
    hub.stop(clock.now());
    finish_when_closed(clock.now() + kStopWithin);
    return;
  }
  stop_timer.expires_after(kPollPeriod);
  stop_timer.async_wait([this, deadline](const error_code&) { send_goodbye_when_answered(deadline); });
}

void LiveServer::Impl::finish_when_closed(LocalTime deadline) {
  if (transport.open_connections() == 0 || clock.now() >= deadline) {
    io.stop();
    return;
  }
  stop_timer.expires_after(kPollPeriod);
  stop_timer.async_wait([this, deadline](const error_code&) { finish_when_closed(deadline); });
}

LiveServer::LiveServer(LiveServerSettings settings, ServerRooms rooms)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), std::move(rooms))) {}

LiveServer::~LiveServer() = default;

std::uint16_t LiveServer::port() const {
  return impl_->transport.port();
}

const std::vector<std::unique_ptr<Room>>& LiveServer::rooms() const {
  return impl_->rooms;
}

ServerRooms& LiveServer::served() {
  return impl_->served;
}

void LiveServer::run() {
  impl_->hub.on_admission = on_admission;
  impl_->run();
}

void LiveServer::stop() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->begin_stop("stopping"); });
}

void LiveServer::abandon() {
  impl_->io.stop();
}

const ServerFigures& LiveServer::newest_figures() {
  impl_->figures.poll();
  return impl_->figures.front();
}

std::vector<RoomTiming> LiveServer::newest_timings() {
  return impl_->scheduler.newest_timings();
}

ServerPulse LiveServer::pulse() const {
  ServerPulse pulse{.is_serving = impl_->is_serving.load(std::memory_order_acquire),
                    .is_stopping = impl_->is_stopping.load(),
                    .users = impl_->users.load(std::memory_order_relaxed),
                    .io = impl_->io_went_round.load(std::memory_order_relaxed)};
  for (std::size_t i = 0; i < impl_->rooms.size(); ++i) pulse.rooms.push_back(impl_->scheduler.went_round(i));
  return pulse;
}

Duration LiveServer::up() const {
  return impl_->ended - impl_->started;
}

const HubCounters& LiveServer::counters() const {
  return impl_->hub.counters();
}

std::uint64_t LiveServer::failed_handshakes() const {
  return impl_->transport.failed_handshakes();
}

std::vector<RoomTiming> LiveServer::room_timings() const {
  return impl_->scheduler.timings();
}

}  // namespace tandem::server
