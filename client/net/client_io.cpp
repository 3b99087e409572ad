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

#include "client/session/credentials.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// Time-outs and reconnection are checked at least this often.
constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
constexpr Duration kSnapshotPeriod = std::chrono::milliseconds(10);
/// Maximum wait of stop() for the leave message to be sent.
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
  Impl(ClientIo& client_io, ClientIoSettings client_settings, devices::Device& device);

  void run();
  void poll();
  void await_ticks();
  void await_poll_time();
  void finish_when_drained(LocalTime deadline);
  void publish_snapshot(LocalTime now);

  ClientIo& owner;
  ClientIoSettings settings;
  SteadyClock clock;
  asio::io_context io{1};
  AsioClientTransport transport;
  Client client;
  ClientSession& session;
  asio::posix::stream_descriptor tick_event;
  asio::steady_timer poll_timer{io};
  asio::steady_timer stop_timer{io};

  std::shared_ptr<const wire::Joined> joined;  // io thread's copy
  std::shared_ptr<const Credentials> beside;   // io thread's copy
  std::shared_ptr<const AssetMap> assets;      // io thread's copy
  LocalTime published_at{};
  mutable std::mutex mutex;  // protects `published`; never taken by the haptic thread
  ClientIoSnapshot published;

  std::thread thread;  // last member: uses all of the above
};

ClientIo::Impl::Impl(ClientIo& client_io, ClientIoSettings client_settings, devices::Device& device)
    : owner(client_io),
      settings(with_models_made_aside(std::move(client_settings))),
      transport(io, settings.host, settings.port, settings.trust, settings.links, clock, settings.resolve),
      client(settings.client, device, transport),
      session(client.session()),
      tick_event(io, open_eventfd()) {
  transport.attach(session);
  session.on_log = [this](const std::string& line) {
    if (owner.on_log) owner.on_log(line);
  };
  session.on_joined = [this](const wire::Joined& answer) {
    joined = std::make_shared<const wire::Joined>(answer);
    beside = session.credentials_beside();
  };
}

void ClientIo::Impl::run() {
  try {
    for (const std::string& line : realtime::request_realtime(settings.realtime_priority)) {
      if (owner.on_log) owner.on_log(line);
    }
    session.start(clock.now());
    await_ticks();
    await_poll_time();
    io.run();
  } catch (const std::exception& error) {
    // Out of memory or threads. Ending the program here would leave the device's last force on.
    session.fail(error.what());
  }
  publish_snapshot(clock.now());
}

void ClientIo::Impl::poll() {
  const LocalTime now = clock.now();
  client.poll(now);
  if (session.status().state != published.status.state || now - published_at >= kSnapshotPeriod) publish_snapshot(now);
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

// Only this thread writes `published`, so it may read it without the lock.
void ClientIo::Impl::publish_snapshot(LocalTime now) {
  ClientIoSnapshot snapshot;
  snapshot.status = session.status();
  snapshot.counters = session.counters();
  snapshot.has_state = session.has_state();
  net::ClockSync& clock_sync = session.clock_sync();
  snapshot.has_clock = clock_sync.has_offset();
  if (snapshot.has_clock) {
    snapshot.clock_offset = clock_sync.offset(now);
    snapshot.round_trip = clock_sync.round_trip();
    snapshot.minimum_round_trip = clock_sync.minimum_round_trip();
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
  snapshot.news = session.news();
  snapshot.coupling = session.coupling();
  snapshot.law = session.law().name;
  snapshot.soft_offsets = session.soft_offsets();
  snapshot.kept_poses = session.kept_poses();
  snapshot.pose_progress = session.pose_progress();
  snapshot.pointed = session.pointed();
  snapshot.has_nudges = session.has_nudges();
  snapshot.coupling_check = session.coupling_check();
  snapshot.stage = client.stage();
  snapshot.stage_note = client.stage_note();
  snapshot.model_problem = client.model_problem();
  snapshot.local_after = client.local_after();
  snapshot.full_local_after = client.full_local_after();
  snapshot.users = session.users();
  if (!session.assets().empty() && (assets == nullptr || assets->size() != session.assets().size())) {
    assets = std::make_shared<const AssetMap>(session.assets());
  }
  snapshot.assets = assets;
  published_at = now;
  const std::lock_guard lock(mutex);
  published = std::move(snapshot);
}

ClientIo::ClientIo(ClientIoSettings settings, devices::Device& device)
    : impl_(std::make_unique<Impl>(*this, std::move(settings), device)) {}

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
  // Fails only when the counter is full: then the io thread has been woken already.
  [[maybe_unused]] const auto written = ::write(impl_->tick_event.native_handle(), &one, sizeof one);
}

void ClientIo::grab(BodyId body) {
  asio::post(impl_->io, [impl = impl_.get(), body] { impl->session.grab(body); });
}

void ClientIo::release() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->session.release(); });
}

void ClientIo::set_parameter(const std::string& name, double value) {
  asio::post(impl_->io, [impl = impl_.get(), name, value] { impl->session.set_parameter(name, value); });
}

void ClientIo::set_law(const std::string& law) {
  asio::post(impl_->io, [impl = impl_.get(), law] { impl->session.set_law(law); });
}

void ClientIo::kick(UserId user) {
  asio::post(impl_->io, [impl = impl_.get(), user] { impl->session.kick(user); });
}

void ClientIo::reset_room() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->session.reset_room(); });
}

void ClientIo::ask_pose(wire::AskPose::Kind kind, std::uint32_t number, const std::string& name,
                        const PoseReply& on_answer) {
  wire::AskPose request;
  request.set_kind(kind);
  request.set_number(number);
  request.set_name(name);
  PoseReply after_snapshot;
  if (on_answer) {
    after_snapshot = [impl = impl_.get(), on_answer](const auto& answer, const auto& minimising) {
      impl->publish_snapshot(impl->clock.now());
      on_answer(answer, minimising);
    };
  }
  asio::post(impl_->io,
             [impl = impl_.get(), request, after_snapshot] { impl->session.ask_pose(request, after_snapshot); });
}

void ClientIo::point(const wire::Point& place) {
  asio::post(impl_->io, [impl = impl_.get(), place] { impl->session.point(place); });
}

void ClientIo::change_room(const std::string& room) {
  asio::post(impl_->io, [impl = impl_.get(), room] { impl->session.change_room(room, impl->clock.now()); });
}

void ClientIo::set_stage(const StageSettings& stage) {
  require_stage(stage);
  asio::post(impl_->io, [impl = impl_.get(), stage] { impl->client.set_stage(stage); });
}

void ClientIo::set_workspace(const WorkspaceSettings& workspace) {
  asio::post(impl_->io, [impl = impl_.get(), workspace] { impl->session.set_workspace(workspace); });
}

void ClientIo::set_nudges(bool has_nudges) {
  asio::post(impl_->io, [impl = impl_.get(), has_nudges] { impl->session.set_nudges(has_nudges); });
}

void ClientIo::set_links(const net::LinkParameters& both) {
  if (const std::string problem = both.problem(); !problem.empty()) throw std::invalid_argument(problem);
  asio::post(impl_->io, [impl = impl_.get(), both] { impl->transport.set_links(both); });
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
