#include "lab/session/client_bench.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "client/haptics/stages/stage.hpp"
#include "client/model/local_model_maker.hpp"
#include "client/session/asset_store.hpp"
#include "common/haptics/prediction/force_stream.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/session/virtual_network.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kJoinTimeout = std::chrono::seconds(30);
/// About as much as a tick of a simple scene takes.
constexpr std::size_t kWorkTerms = 1500;

server::HubSettings hub_settings(std::uint64_t seed) {
  server::HubSettings settings;
  settings.datagram_port = 1;
  settings.connection_ids = [ids = Random(seed)]() mutable { return ids.next_u64(); };
  return settings;
}

client::SessionSettings session_settings(const ExperimentUser& user, const server::LoadedScene& scene) {
  const auto store = std::make_shared<client::MemoryAssetStore>();
  for (const server::Asset& asset : scene.assets) store->keep(asset.sha256, asset.bytes);
  client::SessionSettings settings;
  settings.user_name = user.name;
  settings.state_transport = user.transport;
  settings.deadband = user.pipeline.deadband;
  settings.asset_store = store;
  return settings;
}

/// As a client has it: an experiment's energy ledger costs two thirds of what all the rest does.
client::LocalModelSettings model_settings(const Pipeline& pipeline) {
  client::LocalModelSettings settings = local_model_settings(pipeline);
  settings.keeps_ledger = false;
  return settings;
}

/// A simulated hand that is moved outside of the clock, for a hand's mechanics are no client's work.
class HandAhead final : public devices::Device {
 public:
  explicit HandAhead(devices::SimDevice& hand) : hand_(hand) {}
  /// Before the tick at `now`.
  void move_to(LocalTime now) noexcept { sample_ = hand_.read(now); }

  const devices::DeviceSpec& spec() const noexcept override { return hand_.spec(); }
  devices::DeviceSample read(LocalTime /*now*/) noexcept override { return sample_; }
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override {
    return hand_.write(now, wrench_on_hand_D);
  }

 private:
  devices::SimDevice& hand_;
  devices::DeviceSample sample_;
};

/// A chain of dependent operations: nothing to predict, and too little memory to miss any.
double fixed_work(double x) {
  for (std::size_t i = 0; i < kWorkTerms; ++i) x = 0.999 * x + 1e-3 / (1.0 + x);
  return x;
}

/// What a fit costs, on the wrenches of this very session: a stream with the predictor's settings is given each new
/// one.
class FitMeter {
 public:
  explicit FitMeter(const std::string& predictor) : stream_(haptics::make_force_stream(predictor)) {}

  void see(const client::TickRecord& record, Histogram& times) {
    if (stream_ == nullptr || record.newest_step == seen_) return;
    seen_ = record.newest_step;
    stream_->push(record.at, record.server_wrench_on_hand_W);
    if (!stream_->fit_pending()) return;
    const SteadyClock clock;
    const LocalTime before = clock.now();
    if (stream_->fit()) times.record(clock.now() - before);
  }

 private:
  std::unique_ptr<haptics::ForceStream> stream_;
  Step seen_;
};

/// One user's session with everything that it needs; the order within a slot is that of VirtualSession.
class BenchSession {
 public:
  BenchSession(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene);

  void join();
  ClientBenchRun run();

 private:
  void run_slot();
  void tick();
  void measure_machine();
  void make_local_model();

  const Experiment& experiment_;
  const ExperimentUser& user_;
  VirtualClock virtual_clock_;
  SteadyClock clock_;
  VirtualNetwork network_{virtual_clock_};
  server::Room room_;
  server::SessionHub hub_;
  VirtualClientTransport& transport_;
  client::ClientMailboxes mailboxes_;
  devices::SimDevice device_;
  HandAhead hand_{device_};
  client::HapticCore core_;
  client::ClientSession session_;
  client::LocalModelMaker models_;
  FitMeter fits_;
  std::int64_t slot_ = 0;
  LocalTime next_step_{};
  bool is_measuring_ = false;
  ClientBenchRun run_;
  std::uint64_t local_ticks_ = 0;
  std::uint64_t predicting_ticks_ = 0;
  double work_ = 1;
};

BenchSession::BenchSession(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene)
    : experiment_(experiment),
      user_(experiment.users.front()),
      room_(RoomId{1}, "lab", scene, {.controls_tool_passivity = experiment.controls_passivity()}),
      hub_(hub_settings(experiment.seed), {&room_}, network_),
      transport_(network_.add_client(user_.up, user_.down, experiment.seed)),
      device_(user_.device.spec, devices::holding(user_.hand_parameters, user_.device), user_.hand, experiment.seed),
      core_(haptic_settings(user_.pipeline, devices::coupling_bounds(user_.device)), hand_, mailboxes_),
      session_(session_settings(user_, *scene), transport_, mailboxes_),
      models_(model_settings(user_.pipeline), client::LocalModelMaker::Execution::kInline),
      fits_(user_.pipeline.predictor) {
  device_.hold_path();
  session_.on_assets = [this] { make_local_model(); };
}

void BenchSession::make_local_model() {
  if (!client::needs_local_model(user_.pipeline.stage)) return;
  models_.begin(*session_.joined(), session_.assets());
  client::LocalModel* const model = models_.take();
  if (model == nullptr) throw std::runtime_error(experiment_.name + " has no local model: " + models_.problem());
  session_.use_local_model(model);
}

void BenchSession::run_slot() {
  const LocalTime now{kSlot * ++slot_};
  virtual_clock_.advance_to(now);
  network_.collect(now);
  network_.deliver(hub_, now);
  if (now >= next_step_) {
    room_.step(server_time_of_own_clock(now));
    next_step_ += room_.period();
  }
  hub_.poll(now);
  transport_.deliver(session_, now);
  if ((now.time_since_epoch() - user_.tick_phase) % kHapticPeriod == Duration(0)) tick();
  session_.poll(now);
}

void BenchSession::tick() {
  hand_.move_to(virtual_clock_.now());
  const LocalTime before = clock_.now();
  core_.tick(virtual_clock_.now());
  const Duration took = clock_.now() - before;
  core_.service();
  if (!is_measuring_) return;
  const client::TickRecord& record = core_.record();
  run_.tick.record(took);
  run_.force_max_n = std::max(run_.force_max_n, record.displayed_on_hand_D.f.norm());
  local_ticks_ += record.is_local ? 1 : 0;
  predicting_ticks_ += record.is_predicting ? 1 : 0;
  fits_.see(record, run_.fit);
  measure_machine();
}

void BenchSession::measure_machine() {
  const LocalTime first = clock_.now();
  const LocalTime second = clock_.now();
  work_ = fixed_work(work_);
  run_.clock.record(second - first);
  run_.work.record(clock_.now() - second);
}

void BenchSession::join() {
  session_.start(virtual_clock_.now());
  const LocalTime give_up = virtual_clock_.now() + kJoinTimeout;
  while (session_.status().state != client::SessionState::kActive || core_.record().newest_step.value == 0) {
    if (virtual_clock_.now() >= give_up || session_.status().state == client::SessionState::kEnded) {
      throw std::runtime_error(experiment_.name + ": could not join: " + session_.status().why);
    }
    run_slot();
  }
}

ClientBenchRun BenchSession::run() {
  device_.start_path(virtual_clock_.now());
  is_measuring_ = true;
  const LocalTime end = virtual_clock_.now() + experiment_.duration;
  while (virtual_clock_.now() < end) run_slot();
  if (!std::isfinite(work_)) throw std::runtime_error("the fixed work came to nothing");  // keeps it in the program
  const auto ticks = static_cast<double>(run_.tick.count());
  run_.local_share = static_cast<double>(local_ticks_) / ticks;
  run_.predicting_share = static_cast<double>(predicting_ticks_) / ticks;
  return run_;
}

}  // namespace

ClientBenchRun bench_client(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene) {
  BenchSession session(experiment, scene);
  session.join();
  return session.run();
}

}  // namespace tandem::lab
