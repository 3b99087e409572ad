#include "server/metrics/monitor.hpp"

#include <utility>

#include "server/metrics/health.hpp"

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

Monitor::Monitor(const std::optional<std::string>& metrics, std::optional<std::uint16_t> agones,
                 std::function<void(const std::string&)> on_news) {
  if (metrics) {
    port_ = std::make_unique<HttpPort>("--metrics", *metrics, [this](const std::string& path) { return answer(path); });
  }
  if (agones) {
    agones_ = std::make_unique<Agones>(
        *agones, [this] { return seen(); }, std::move(on_news));
  }
}

std::shared_ptr<void> Monitor::watch(LiveServer& server, const ServerRecorder* recorder,
                                     const ServerCheckpoint* checkpoint) {
  const std::lock_guard lock(mutex_);
  server_ = &server;
  recorder_ = recorder;
  checkpoint_ = checkpoint;
  for (const auto& room : server.rooms()) {
    rooms_.push_back(room->name());
    meters_.push_back(std::make_unique<RoomMeter>());
    if (port_) room->watch(*meters_.back());
  }
  return {nullptr, [this](void*) { finish(); }};
}

void Monitor::finish() {
  {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    server_ = nullptr;
    recorder_ = nullptr;
    checkpoint_ = nullptr;
  }
  if (agones_) agones_->finish();
}

std::string Monitor::address() const {
  return port_ ? port_->address() : "";
}

std::string Monitor::standing_still() const {
  return server_ == nullptr ? "" : standstill(server_->pulse(), rooms_, SteadyClock().now());
}

std::string Monitor::not_ready() const {
  if (has_ended_) return "the server has ended";
  if (server_ == nullptr) return "rooms are being loaded";
  return why_not_ready(server_->pulse(), rooms_, SteadyClock().now());
}

MetricsSnapshot Monitor::snapshot() {
  MetricsSnapshot snapshot;
  snapshot.is_ready = not_ready().empty();
  snapshot.is_healthy = standing_still().empty();
  if (server_ == nullptr) return snapshot;
  snapshot.server = server_->newest_figures();
  std::vector<RoomTiming> timings = server_->newest_timings();
  for (std::size_t i = 0; i < rooms_.size(); ++i) {
    RoomFigures& room = snapshot.rooms.emplace_back(figures_of(*server_->rooms()[i], timings[i], *meters_[i]));
    if (recorder_ == nullptr) continue;
    const RoomRecorder& recorder = *recorder_->rooms()[i];
    room.is_recorded = true;
    room.recorded_bytes = recorder.file().bytes_written();
    room.recorded_messages_lost = recorder.file().messages_lost();
    room.recorded_steps_lost = recorder.steps_lost();
  }
  if (checkpoint_ == nullptr) return snapshot;
  snapshot.has_checkpoint = true;
  snapshot.checkpoint_writes = checkpoint_->writes();
  snapshot.checkpoint_failures = checkpoint_->failures();
  return snapshot;
}

std::optional<HttpAnswer> Monitor::answer(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (path == "/healthz") return yes_unless(standing_still());
  if (path == "/readyz") return yes_unless(not_ready());
  if (path != "/metrics") return std::nullopt;
  return HttpAnswer{200, metrics_text(snapshot()) + process_metrics_text(), "text/plain; version=0.0.4; charset=utf-8"};
}

AgonesPlan::Seen Monitor::seen() {
  const std::lock_guard lock(mutex_);
  return {.is_ready = not_ready().empty(),
          .is_healthy = standing_still().empty(),
          .has_ended = has_ended_,
          .users = server_ == nullptr ? 0 : server_->pulse().users};
}

}  // namespace tandem::server
