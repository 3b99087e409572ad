#include "server/metrics/monitor.hpp"

#include <mutex>
#include <utility>
#include <vector>

#include "server/metrics/health.hpp"
#include "server/metrics/metrics_text.hpp"
#include "server/metrics/room_meter.hpp"

namespace tandem::server {
namespace {

HttpAnswer yes_unless(const std::string& why_not) {
  return why_not.empty() ? HttpAnswer{200, "ok\n"} : HttpAnswer{503, why_not + "\n"};
}

RoomFigures figures_of(const Room& room, const RoomTiming& timing, const RoomMeter& meter) {
  RoomFigures figures;
  figures.name = room.name();
  figures.period = room.period();
  figures.is_awake = meter.is_awake();
  figures.timing = timing;
  figures.braked_j = meter.braked_j();
  figures.events_lost = meter.events_lost();
  for (std::size_t bit = 0; bit < kTickFaultBits; ++bit) figures.fault_steps[bit] = meter.fault_steps(bit);
  return figures;
}

}  // namespace

struct Monitor::Impl {
  std::optional<HttpAnswer> answer(const std::string& path);
  AgonesPlan::Seen seen();
  void finish();
  // The caller of these functions must hold the lock.
  std::string standing_still() const;
  std::string not_ready() const;
  MetricsSnapshot snapshot();

  std::mutex mutex;  ///< used by the threads of the monitor and by Monitor's callers; io and rooms never lock it
  LiveServer* server = nullptr;
  const ServerRecorder* recorder = nullptr;
  const ServerCheckpoint* checkpoint = nullptr;
  const std::vector<std::unique_ptr<RoomMeter>>* meters = nullptr;  ///< valid while a server is attached
  bool has_ended = false;
  std::vector<std::string> rooms;
  // The threads of these objects use the members above. Therefore the objects are declared last.
  std::unique_ptr<HttpPort> port;
  std::unique_ptr<Agones> agones;
};

/// Detaches the server from the monitor's threads before the server is destroyed.
class Monitor::Watch final : public RoomService {
 public:
  Watch(std::shared_ptr<Impl> impl, const LiveServer& server) : impl_(std::move(impl)) {
    for (const auto& room : server.rooms()) {
      meters.push_back(std::make_unique<RoomMeter>());
      if (impl_->port) room->watch(*meters.back());
    }
  }
  ~Watch() override { impl_->finish(); }
  void finish() override { impl_->finish(); }

  std::vector<std::unique_ptr<RoomMeter>> meters;

 private:
  std::shared_ptr<Impl> impl_;
};

Monitor::Monitor(const std::optional<std::string>& metrics, std::optional<std::uint16_t> agones,
                 std::function<void(const std::string&)> on_news)
    : impl_(std::make_shared<Impl>()) {
  Impl* const impl = impl_.get();
  if (metrics) {
    impl->port = std::make_unique<HttpPort>("--metrics", *metrics,
                                            [impl](const std::string& path) { return impl->answer(path); });
  }
  if (agones) {
    impl->agones = std::make_unique<Agones>(
        *agones, [impl] { return impl->seen(); }, std::move(on_news));
  }
}

void Monitor::watch(LiveServer& server, const ServerRecorder* recorder, const ServerCheckpoint* checkpoint) {
  const Watch* const watch = server.add(std::make_unique<Watch>(impl_, server));
  const std::lock_guard lock(impl_->mutex);
  impl_->server = &server;
  impl_->recorder = recorder;
  impl_->checkpoint = checkpoint;
  impl_->meters = &watch->meters;
  for (const auto& room : server.rooms()) impl_->rooms.push_back(room->name());
}

void Monitor::Impl::finish() {
  {
    const std::lock_guard lock(mutex);
    has_ended = true;
    server = nullptr;
    recorder = nullptr;
    checkpoint = nullptr;
    meters = nullptr;
  }
  if (agones) agones->finish();
}

std::string Monitor::address() const {
  return impl_->port ? impl_->port->address() : "";
}

std::string Monitor::Impl::standing_still() const {
  return server == nullptr ? "" : standstill(server->pulse(), rooms, SteadyClock().now());
}

std::string Monitor::Impl::not_ready() const {
  if (has_ended) return "the server has ended";
  if (server == nullptr) return "rooms are being loaded";
  return why_not_ready(server->pulse(), rooms, SteadyClock().now());
}

MetricsSnapshot Monitor::Impl::snapshot() {
  MetricsSnapshot snapshot;
  snapshot.is_ready = not_ready().empty();
  snapshot.is_healthy = standing_still().empty();
  if (server == nullptr) return snapshot;
  snapshot.server = server->newest_figures();
  std::vector<RoomTiming> timings = server->newest_timings();
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    RoomFigures& room = snapshot.rooms.emplace_back(figures_of(*server->rooms()[i], timings[i], *(*meters)[i]));
    if (recorder == nullptr) continue;
    const RoomRecorder& recording = *recorder->rooms()[i];
    room.is_recorded = true;
    room.recorded_bytes = recording.file().bytes_written();
    room.recorded_messages_lost = recording.file().messages_lost();
    room.recorded_steps_lost = recording.steps_lost();
  }
  if (checkpoint == nullptr) return snapshot;
  snapshot.has_checkpoint = true;
  snapshot.checkpoint_writes = checkpoint->writes();
  snapshot.checkpoint_failures = checkpoint->failures();
  return snapshot;
}

std::optional<HttpAnswer> Monitor::Impl::answer(const std::string& path) {
  const std::lock_guard lock(mutex);
  if (path == "/healthz") return yes_unless(standing_still());
  if (path == "/readyz") return yes_unless(not_ready());
  if (path != "/metrics") return std::nullopt;
  return HttpAnswer{200, metrics_text(snapshot()) + process_metrics_text(), "text/plain; version=0.0.4; charset=utf-8"};
}

AgonesPlan::Seen Monitor::Impl::seen() {
  const std::lock_guard lock(mutex);
  return {.is_ready = not_ready().empty(),
          .is_healthy = standing_still().empty(),
          .has_ended = has_ended,
          .users = server == nullptr ? 0 : server->pulse().users};
}

}  // namespace tandem::server
