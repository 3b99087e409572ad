#include "lab/session/live_room.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <system_error>
#include <thread>

#include "common/base/random.hpp"
#include "server/net/asio_server_transport.hpp"

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// Time-outs are checked at least this often, even when the room does not step; as in LiveServer.
constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
constexpr Duration::rep kNotYet = -1;

int open_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
  return descriptor;
}

realtime::RealtimeRequest realtime(int priority) {
  realtime::RealtimeRequest request;
  request.priority = priority;
  request.lock_memory = priority > 0;
  return request;
}

// Seeded ids are good enough for a trial, whose only clients are its own.
server::HubSettings hub_settings(std::uint16_t port, std::uint64_t seed) {
  server::HubSettings settings;
  settings.datagram_port = port;
  settings.connection_ids = [ids = Random(seed)]() mutable { return ids.next_u64(); };
  return settings;
}

}  // namespace

struct LiveRoom::Impl {
  Impl(std::shared_ptr<const server::LoadedScene> its_scene, const Experiment& its_experiment, int its_priority);

  void start();
  void await_steps();
  void await_poll_time();
  void after_step() noexcept;
  void record(Duration since_start);

  std::shared_ptr<const server::LoadedScene> scene;
  const Experiment& experiment;
  int priority;
  SteadyClock clock;
  server::Room room;
  asio::io_context io{1};
  server::AsioServerTransport transport;
  server::SessionHub hub;
  asio::posix::stream_descriptor step_event;
  asio::steady_timer poll_timer{io};
  server::RoomScheduler scheduler;
  std::thread io_thread;

  std::atomic<Duration::rep> start_ns{kNotYet};
  Duration next_bodies{0};           // room thread
  std::vector<BodiesSample> bodies;  // likewise, until it has stopped; reserved, so that no step allocates for it
  std::size_t bodies_taken = 0;      // likewise
  std::vector<StoredEnergySample> stored;
};

LiveRoom::Impl::Impl(std::shared_ptr<const server::LoadedScene> its_scene, const Experiment& its_experiment,
                     int its_priority)
    : scene(std::move(its_scene)),
      experiment(its_experiment),
      priority(its_priority),
      room(
          RoomId{1}, "lab", scene,
          {.soft_stepping = server::SoftStepping::kWorker, .controls_tool_passivity = experiment.controls_passivity()}),
      transport(io, "127.0.0.1", 0, clock),
      hub(hub_settings(transport.port(), experiment.seed), {&room}, transport),
      step_event(io, open_eventfd()),
      scheduler({&room}, realtime(its_priority), [this] { after_step(); }) {
  BodiesSample blank;
  blank.X_WB.resize(scene->world.bodies.size());
  bodies.resize(static_cast<std::size_t>(experiment.duration / experiment.sample_period) + 1, blank);
  stored.reserve(static_cast<std::size_t>(experiment.duration / room.period()) + 2);
}

void LiveRoom::Impl::start() {
  scheduler.start();
  transport.serve(hub);
  await_steps();
  await_poll_time();
  io_thread = std::thread([this] {
    realtime::request_realtime(realtime(priority > 0 ? priority + 1 : 0));
    io.run();
  });
}

void LiveRoom::Impl::await_steps() {
  step_event.async_wait(asio::posix::stream_descriptor::wait_read, [this](const error_code& error) {
    if (error) return;
    std::uint64_t count = 0;
    [[maybe_unused]] const auto taken = ::read(step_event.native_handle(), &count, sizeof count);
    hub.poll(clock.now());
    await_steps();
  });
}

void LiveRoom::Impl::await_poll_time() {
  poll_timer.expires_after(kPollPeriod);
  poll_timer.async_wait([this](const error_code& error) {
    if (error) return;
    hub.poll(clock.now());
    await_poll_time();
  });
}

void LiveRoom::Impl::after_step() noexcept {
  const std::uint64_t one = 1;
  // Fails only when the counter is full: then the io thread has been woken already.
  [[maybe_unused]] const auto written = ::write(step_event.native_handle(), &one, sizeof one);
  const Duration::rep start = start_ns.load(std::memory_order_acquire);
  if (start == kNotYet) return;
  const Duration since = clock.now().time_since_epoch() - Duration(start);
  if (since >= Duration(0) && since <= experiment.duration) record(since);
}

void LiveRoom::Impl::record(Duration since_start) {
  if (stored.size() < stored.capacity()) stored.push_back({since_start, room.world().stored_energy_j()});
  if (since_start < next_bodies || bodies_taken == bodies.size()) return;
  BodiesSample& sample = bodies[bodies_taken++];
  sample.time = since_start;
  for (std::size_t i = 0; i < sample.X_WB.size(); ++i) sample.X_WB[i] = room.world().body(body_id_at(i)).X;
  sample.field_energy_kj_per_mol = room.world().field_energy_kj_per_mol();
  while (next_bodies <= since_start) next_bodies += experiment.sample_period;
}

LiveRoom::LiveRoom(std::shared_ptr<const server::LoadedScene> scene, const Experiment& experiment,
                   int realtime_priority)
    : impl_(std::make_unique<Impl>(std::move(scene), experiment, realtime_priority)) {
  impl_->start();
}

LiveRoom::~LiveRoom() {
  stop();
}

std::uint16_t LiveRoom::port() const {
  return impl_->transport.port();
}

void LiveRoom::record_from(LocalTime start) {
  impl_->start_ns.store(start.time_since_epoch().count(), std::memory_order_release);
}

void LiveRoom::stop() {
  if (!impl_->io_thread.joinable()) return;
  impl_->scheduler.stop();
  impl_->io.stop();
  impl_->io_thread.join();
  impl_->bodies.resize(impl_->bodies_taken);
}

std::vector<BodiesSample>& LiveRoom::bodies() {
  return impl_->bodies;
}

std::vector<StoredEnergySample>& LiveRoom::stored() {
  return impl_->stored;
}

const server::HubCounters& LiveRoom::counters() const {
  return impl_->hub.counters();
}

std::uint64_t LiveRoom::steps() const {
  return impl_->room.steps_done().value;
}

server::RoomTiming LiveRoom::timing() const {
  return impl_->scheduler.timings().front();
}

}  // namespace tandem::lab
