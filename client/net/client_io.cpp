#include "client/net/client_io.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <mutex>
#include <system_error>
#include <thread>

#include "client/net/event_queue.hpp"
#include "client/session/credentials.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// Period of checking time-outs and reconnecting.
constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
constexpr Duration kSnapshotPeriod = std::chrono::milliseconds(10);
/// Maximum time for which stop() waits until the leave message is sent.
constexpr Duration kStopWithin = std::chrono::milliseconds(500);

int open_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
  return descriptor;
}

ClientIoSettings with_models_made_aside(ClientIoSettings settings) {
  settings.client.makes_models_aside = true;
  return settings;
}

}  // namespace

struct ClientIo::Impl {
  Impl(ClientIoSettings client_settings, devices::Device& device);

  void run();
  void poll();
  void await_ticks();
  void await_poll_time();
  void finish_when_drained(LocalTime deadline);
  void perform(const Command& command);
  void publish_snapshot(LocalTime now);

  ClientIoSettings settings;
  SteadyClock clock;
  asio::io_context io{1};
  AsioClientTransport transport;
  Client client;
  ClientSession& session;
  asio::posix::stream_descriptor tick_event;
  asio::steady_timer poll_timer{io};
  asio::steady_timer stop_timer{io};

  std::shared_ptr<const wire::Joined> joined;  // answer to the last join; only the io thread uses this pointer
  std::shared_ptr<const Credentials> beside;   // see ClientSession::credentials_beside(); io thread only
  std::shared_ptr<const AssetMap> assets;      // received assets; only the io thread uses this pointer
  EventQueue new_events;                       // events since the last snapshot; only the io thread uses this queue
  LocalTime published_at{};
  mutable std::mutex mutex;  // protects `published` and `events`; the haptic thread never locks it
  ClientIoSnapshot published;
  EventQueue events;

  std::thread thread;  // last member: starts after the members that it uses are constructed
};

ClientIo::Impl::Impl(ClientIoSettings client_settings, devices::Device& device)
    : settings(with_models_made_aside(std::move(client_settings))),
      transport(io, settings.host, settings.port, settings.trust, settings.links, clock, settings.resolve),
      client(settings.client, device, transport),
      session(client.session()),
      tick_event(io, open_eventfd()) {
  transport.attach(session);
  session.on_event = [this](const Event& event) {
    if (const auto* const answer = std::get_if<event::Joined>(&event)) {
      joined = answer->answer;
      beside = session.credentials_beside();
    }
    new_events.push(event);
  };
}

void ClientIo::Impl::run() {
  try {
    for (const std::string& line : realtime::request_realtime(settings.realtime_priority)) {
      session.on_event(event::Log{line});
    }
    session.start(clock.now());
    await_ticks();
    await_poll_time();
    io.run();
  } catch (const std::exception& error) {
    // Possible causes: the system is out of memory or of threads. If the program ended here, the device would keep its
    // last force, so only the session fails.
    session.fail(error.what());
  }
  publish_snapshot(clock.now());
}

void ClientIo::Impl::poll() {
  const LocalTime now = clock.now();
  client.poll(now);
  const bool has_news = session.status().state != published.status.state || !new_events.is_empty();
  if (has_news || now - published_at >= kSnapshotPeriod) publish_snapshot(now);
}

void ClientIo::Impl::await_ticks() {
  tick_event.async_wait(asio::posix::stream_descriptor::wait_read, [this](const error_code& error) {
    if (error) return;
    std::uint64_t count = 0;
    [[maybe_unused]] const auto taken = ::read(tick_event.native_handle(), &count, sizeof count);
    poll();
    await_ticks();
  });
}

void ClientIo::Impl::await_poll_time() {
  poll_timer.expires_after(kPollPeriod);
  poll_timer.async_wait([this](const error_code& error) {
    if (error) return;
    poll();
    await_poll_time();
  });
}

void ClientIo::Impl::finish_when_drained(LocalTime deadline) {
  if (transport.is_drained() || clock.now() >= deadline) {
    io.stop();
    return;
  }
  stop_timer.expires_after(kPollPeriod);
  stop_timer.async_wait([this, deadline](const error_code&) { finish_when_drained(deadline); });
}

void ClientIo::Impl::perform(const Command& command) {
  if (const auto* const links = std::get_if<command::SetLinks>(&command)) return transport.set_links(links->both);
  client.send(std::get<ClientCommand>(command), clock.now());
}

// Publishes a snapshot of the session. Only this thread writes `published`, so this thread may read it without the
// lock.
void ClientIo::Impl::publish_snapshot(LocalTime now) {
  ClientIoSnapshot snapshot;
  snapshot.status = session.status();
  snapshot.counters = session.counters();
  snapshot.has_state = session.has_state();
  net::ClockSync& clock_sync = session.clock_sync();
  if (clock_sync.has_offset()) {
    snapshot.clock = {true, clock_sync.offset(now), clock_sync.round_trip(), clock_sync.minimum_round_trip()};
  }
  snapshot.links = transport.link_traffic();
  const net::LinkCounters& up = snapshot.links.up;
  const net::LinkCounters& down = snapshot.links.down;
  snapshot.counters.sent_drops.add(proto::DropReason::kSimulatedLoss, up.lost + up.queue_full);
  snapshot.counters.received_drops.add(proto::DropReason::kSimulatedLoss, down.lost + down.queue_full);
  for (const auto& [hash, bytes] : session.assets()) snapshot.asset_bytes += bytes->size();
  snapshot.joined = joined;
  snapshot.beside = beside;
  snapshot.room = session.room();
  snapshot.rooms = session.rooms();
  snapshot.hand_start = session.hand_start();
  snapshot.coupling = session.coupling();
  snapshot.law = session.law().name;
  snapshot.soft_offsets = session.soft_offsets();
  snapshot.kept_poses = session.kept_poses();
  snapshot.pose_progress = session.pose_progress();
  snapshot.pointed = session.pointed();
  snapshot.game = session.game();
  snapshot.has_nudges = session.has_nudges();
  snapshot.coupling_check = session.coupling_check();
  snapshot.rendering = {client.stage(), client.stage_note(), client.model_problem(), client.local_after(),
                        client.full_local_after()};
  snapshot.users = session.users();
  if (!session.assets().empty() && (assets == nullptr || assets->size() != session.assets().size())) {
    assets = std::make_shared<const AssetMap>(session.assets());
  }
  snapshot.assets = assets;
  published_at = now;
  bool has_events = false;
  {
    const std::lock_guard lock(mutex);
    published = std::move(snapshot);
    while (std::optional<Event> event = new_events.pop()) {
      events.push(std::move(*event));
      has_events = true;
    }
    published.events_dropped = new_events.dropped() + events.dropped();
  }
  if (has_events && settings.on_events) settings.on_events();
}

ClientIo::ClientIo(ClientIoSettings settings, devices::Device& device)
    : impl_(std::make_unique<Impl>(std::move(settings), device)) {}

ClientIo::~ClientIo() {
  stop();
}

void ClientIo::set_credentials(const Credentials& credentials) {
  impl_->session.set_credentials(credentials);
}

void ClientIo::start() {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

HapticCore& ClientIo::haptics() {
  return impl_->client.haptics();
}
const HapticCore& ClientIo::haptics() const {
  return impl_->client.haptics();
}

void ClientIo::notify() noexcept {
  const std::uint64_t one = 1;
  // Writing fails only if the counter is full, and then the io thread is about to wake up anyway.
  [[maybe_unused]] const auto written = ::write(impl_->tick_event.native_handle(), &one, sizeof one);
}

void ClientIo::send(Command command) {
  if (const auto* const links = std::get_if<command::SetLinks>(&command)) {
    if (const std::string problem = links->both.problem(); !problem.empty()) throw std::invalid_argument(problem);
  } else if (const auto* const stage = std::get_if<command::SetStage>(&std::get<ClientCommand>(command))) {
    require_stage(stage->stage);
  }
  asio::post(impl_->io, [impl = impl_.get(), command = std::move(command)] { impl->perform(command); });
}

std::optional<Event> ClientIo::next() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->events.pop();
}

void ClientIo::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->io, [impl = impl_.get()] {
    const LocalTime now = impl->clock.now();
    impl->session.leave(now);
    impl->finish_when_drained(now + kStopWithin);
  });
  impl_->thread.join();
}

ClientIoSnapshot ClientIo::snapshot() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->published;
}

}  // namespace tandem::client
