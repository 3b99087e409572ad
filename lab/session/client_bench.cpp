#include "lab/session/client_bench.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "client/client.hpp"
#include "common/haptics/prediction/force_stream.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/session/session_settings.hpp"
#include "lab/session/virtual_network.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kJoinTimeout = std::chrono::seconds(30);
/// About as much as a tick of a simple scene takes.
constexpr std::size_t kWorkTerms = 1500;

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

/// One user's session with everything that it needs; the order within a slot is that of run_virtual_session().
class BenchSession {
 public:
  BenchSession(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene);

  void join();
  ClientBenchRun run();

 private:
  void run_slot();
  void tick();
  void measure_machine();

  const Experiment& experiment_;
  const ExperimentUser& user_;
  VirtualClock virtual_clock_;
  SteadyClock clock_;
  VirtualNetwork network_{virtual_clock_};
  server::Room room_;
  server::SessionHub hub_;
  VirtualClientTransport& transport_;
  devices::SimDevice device_;
  HandAhead hand_{device_};
  client::Client client_;
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
      client_(client_settings(user_, assets_of(*scene)), hand_, transport_),
      fits_(user_.pipeline.predictor) {
  device_.hold_path();
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
  transport_.deliver(client_.session(), now);
  if ((now.time_since_epoch() - user_.tick_phase) % kHapticPeriod == Duration(0)) tick();
  client_.poll(now);
  if (client_.model_problem().empty()) return;
  throw std::runtime_error(experiment_.name + " has no local model: " + client_.model_problem());
}

void BenchSession::tick() {
  hand_.move_to(virtual_clock_.now());
  const LocalTime before = clock_.now();
  client_.haptics().tick(virtual_clock_.now());
  const Duration took = clock_.now() - before;
  if (!is_measuring_) return;
  const client::TickRecord& record = client_.haptics().record();
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
  client_.session().start(virtual_clock_.now());
  const LocalTime give_up = virtual_clock_.now() + kJoinTimeout;
  while (client_.session().status().state != client::SessionState::kActive ||
         client_.haptics().record().newest_step.value == 0) {
    if (virtual_clock_.now() >= give_up || client_.session().status().state == client::SessionState::kEnded) {
      throw std::runtime_error(experiment_.name + ": could not join: " + client_.session().status().why);
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
