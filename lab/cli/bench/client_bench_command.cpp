// `tandem-lab bench client`: measures the duration of one haptic tick of a client with all processing enabled, in a
// session with server and link. The result is compared with the same session with all processing disabled, and with a
// fixed computation on the same machine.
//
// The session is a trial in virtual time: the same hand, client, link and server. Only the client's tick is timed. The
// simulation of the hand and the energy ledger, which a real client does not have, are excluded.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/client.hpp"
#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "common/haptics/prediction/force_stream.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "lab/experiment/quantities.hpp"
#include "lab/report/check.hpp"
#include "lab/session/session_settings.hpp"
#include "lab/session/virtual_network.hpp"

namespace tandem::lab {
namespace {

/// Results of one run of a session.
struct ClientBenchRun {
  Histogram tick;   ///< duration of HapticCore::tick(), including the reads of the clock
  Histogram fit;    ///< duration of one fit of the AR models outside the tick: six axes, with the settings of the stage
  Histogram clock;  ///< duration of one read of the clock, measured at each tick
  Histogram work;   ///< duration of a fixed computation at each tick; its tail shows the timing jitter of the machine
  double force_max_n = 0;
  double local_share = 0;       ///< fraction of the ticks in which the displayed force comes from the local model
  double predicting_share = 0;  ///< fraction of the ticks in which a part of the force is predicted
};

constexpr Duration kJoinTimeout = std::chrono::seconds(30);
/// Number of terms of the fixed computation, chosen such that it takes about as long as a tick of a simple scene.
constexpr std::size_t kWorkTerms = 1500;

/// Device of the measured client. It simulates the hand before a tick and only returns the result during the tick. Thus
/// the measured time of a tick does not include the mechanics of the hand.
class HandAhead final : public devices::Device {
 public:
  explicit HandAhead(devices::SimDevice& hand) : hand_(hand) {}
  /// Moves the hand before the tick at `now`.
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

/// A chain of dependent operations without branches or memory accesses, so that neither mispredictions nor cache misses
/// occur.
double fixed_work(double x) {
  for (std::size_t i = 0; i < kWorkTerms; ++i) x = 0.999 * x + 1e-3 / (1.0 + x);
  return x;
}

/// Measures the duration of a fit of the AR models to the wrenches of this session. Each new wrench is passed to a
/// separate force stream, which has the settings of the session's predictor.
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

/// The session of one user with all its parts. The order of events within a slot is that of run_virtual_session().
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
  device_.begin_path_at(LocalTime::max());
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
  hub_.poll(VirtualClock(now));
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
  device_.read(virtual_clock_.now());
  device_.begin_path_at(virtual_clock_.now());
  is_measuring_ = true;
  const LocalTime end = virtual_clock_.now() + experiment_.duration;
  while (virtual_clock_.now() < end) run_slot();
  // Using the result prevents the compiler from removing the computation.
  if (!std::isfinite(work_)) throw std::runtime_error("the fixed computation gave no result");
  const auto ticks = static_cast<double>(run_.tick.count());
  run_.local_share = static_cast<double>(local_ticks_) / ticks;
  run_.predicting_share = static_cast<double>(predicting_ticks_) / ticks;
  return run_;
}

/// Runs the first user of the experiment alone, faster than real time, from joining until the end of the experiment.
/// The server runs on the same core between two ticks and displaces the client's data from the caches. A real client
/// that shares its core with other programs has the same disadvantage.
///
/// Fails   std::runtime_error: the user cannot join the room, or has no local model although the stage requires one
ClientBenchRun bench_client(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene) {
  BenchSession session(experiment, scene);
  session.join();
  return session.run();
}

/// A claim: upper limit for the 99th percentile of a tick's duration [µs]. It is well below the period of 1000 µs,
/// because device access (USB), wake-up and network need time too.
struct Claim {
  const char* experiment;
  double tick_p99_us;
};
constexpr std::array kClaims{Claim{"bunny", 150}, Claim{"wall", 20}};
/// Upper limit for the median duration of a fit [µs]. A fit runs outside the tick, but on the thread that reads the
/// sockets: received data waits until the fit ends.
constexpr double kFitMedian_us = 200;

struct Variant {
  const char* name;
  const char* stage;
  const char* predictor;
  bool passivity;
};
constexpr Variant kFull{"everything", "local-model", "ar-spline", true};
constexpr Variant kPeer{"late-pose", "late-pose", "none", false};

struct ClientBenchOptions {
  double rtt_ms = 50;
  std::size_t repetitions = 3;
  bool has_check = false;
  bool prints_json = false;
};

/// The runs of one experiment. Runs with all processing enabled and disabled alternate, so that a change of the
/// processor's clock rate affects both.
struct ClientBenchRow {
  Claim claim{};
  std::vector<ClientBenchRun> full;
  std::vector<ClientBenchRun> peer;
};

/// Computes a quantile for each repetition and returns the median of these quantiles, so that a single interrupted
/// repetition does not determine the result.
double quantile_us(const std::vector<ClientBenchRun>& runs, Histogram ClientBenchRun::*of, double q) {
  std::vector<double> values;
  for (const ClientBenchRun& run : runs) values.push_back(microseconds((run.*of).quantile(q)));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Experiment experiment_of(const Claim& claim, const Variant& variant, const ClientBenchOptions& options) {
  const std::vector<std::string> names{claim.experiment};
  ExperimentFile file = read_experiment_file(experiment_files(names).front());
  set_quantity(file.document, "stage", variant.stage);
  set_quantity(file.document, "predictor", variant.predictor);
  set_quantity(file.document, "passivity", variant.passivity);
  set_quantity(file.document, "link.rtt_ms", options.rtt_ms);
  return parse_experiment(file);
}

ClientBenchRow measured(const Claim& claim, const ClientBenchOptions& options) {
  const Experiment full = experiment_of(claim, kFull, options);
  const Experiment peer = experiment_of(claim, kPeer, options);
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  const auto scene = load_experiment_scene(full, loading);
  ClientBenchRow row;
  row.claim = claim;
  for (std::size_t i = 0; i < options.repetitions; ++i) {
    row.full.push_back(bench_client(full, scene));
    row.peer.push_back(bench_client(peer, scene));
  }
  return row;
}

std::vector<Check> checks_of(const std::vector<ClientBenchRow>& rows) {
  std::vector<Check> checks;
  for (const ClientBenchRow& row : rows) {
    checks.push_back({row.claim.experiment, "p99 of a tick", quantile_us(row.full, &ClientBenchRun::tick, 0.99),
                      Relation::kAtMost, row.claim.tick_p99_us, "µs", 1});
    checks.push_back({row.claim.experiment, "median of a fit", quantile_us(row.full, &ClientBenchRun::fit, 0.5),
                      Relation::kAtMost, kFitMedian_us, "µs", 1});
  }
  return checks;
}

boost::json::object quantiles_us(const std::vector<ClientBenchRun>& runs, Histogram ClientBenchRun::*of) {
  return {{"count", (runs.front().*of).count()},
          {"p50", quantile_us(runs, of, 0.5)},
          {"p99", quantile_us(runs, of, 0.99)},
          {"p999", quantile_us(runs, of, 0.999)},
          {"max", quantile_us(runs, of, 1)}};
}

boost::json::object runs_json(const Variant& variant, const std::vector<ClientBenchRun>& runs) {
  boost::json::object result{{"stage", variant.stage},
                             {"predictor", variant.predictor},
                             {"passivity", variant.passivity},
                             {"tick_us", quantiles_us(runs, &ClientBenchRun::tick)},
                             {"clock_us", quantiles_us(runs, &ClientBenchRun::clock)},
                             {"fixed_work_us", quantiles_us(runs, &ClientBenchRun::work)},
                             {"force_max_n", runs.front().force_max_n},
                             {"local_share", runs.front().local_share},
                             {"predicting_share", runs.front().predicting_share}};
  if (runs.front().fit.count() > 0) result["fit_us"] = quantiles_us(runs, &ClientBenchRun::fit);
  return result;
}

boost::json::object to_json(const ClientBenchOptions& options, const std::vector<ClientBenchRow>& rows,
                            const std::vector<Check>& checks) {
  boost::json::array experiments;
  for (const ClientBenchRow& row : rows) {
    experiments.push_back(boost::json::object{{"experiment", row.claim.experiment},
                                              {kFull.name, runs_json(kFull, row.full)},
                                              {kPeer.name, runs_json(kPeer, row.peer)}});
  }
  return {{"rtt_ms", options.rtt_ms},
          {"repetitions", options.repetitions},
          {"rows", experiments},
          {"checks", to_json(checks)}};
}

void print_line(const std::string& name, const std::vector<ClientBenchRun>& runs, Histogram ClientBenchRun::*of) {
  std::ostringstream line;
  line << "  " << std::left << std::setw(44) << name << std::right << std::setw(9) << (runs.front().*of).count()
       << std::fixed << std::setprecision(2);
  for (const double q : {0.5, 0.99, 0.999, 1.0}) line << std::setw(10) << quantile_us(runs, of, q);
  std::cout << line.str() << '\n';
}

void print(const ClientBenchOptions& options, const std::vector<ClientBenchRow>& rows,
           const std::vector<Check>& checks) {
  std::cout << "one haptic tick [µs], clock reading included; round trip " << options.rtt_ms << " ms; medians over "
            << options.repetitions << " runs\n";
  for (const ClientBenchRow& row : rows) {
    std::cout << "\n"
              << std::left << std::setw(46) << row.claim.experiment
              << "    times       p50       p99     p99.9       max\n";
    print_line("tick: local-model, ar-spline, passivity", row.full, &ClientBenchRun::tick);
    print_line("tick: late-pose", row.peer, &ClientBenchRun::tick);
    print_line("fit off the path", row.full, &ClientBenchRun::fit);
    print_line("the machine: a fixed computation", row.full, &ClientBenchRun::work);
    print_line("the machine: reading the clock", row.full, &ClientBenchRun::clock);
    std::cout << "  force up to " << row.full.front().force_max_n << " N; the local model drove the hand in "
              << 100 * row.full.front().local_share << " % of the ticks\n";
  }
  std::cout << '\n';
  print_checks(std::cout, checks);
}

int run_client_bench(const ClientBenchOptions& options) {
  std::vector<ClientBenchRow> rows;
  for (const Claim& claim : kClaims) rows.push_back(measured(claim, options));
  const std::vector<Check> checks = checks_of(rows);
  if (options.prints_json) {
    std::cout << pretty_json(to_json(options, rows, checks));
  } else {
    print(options, rows, checks);
  }
  return !options.has_check || all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_client_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<ClientBenchOptions>();
  CLI::App* command =
      bench.add_subcommand("client", "One haptic tick with everything on, in a session in virtual time");
  command->add_option("--rtt-ms", options->rtt_ms, "round trip of the simulated link [ms]")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--repetitions", options->repetitions, "number of runs; medians are reported")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_flag("--check", options->has_check, "exit code 1 when a time is above its bound");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->footer("Exit code: 0 done, 1 a bound does not hold and --check is given, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_client_bench(*options); });
}

}  // namespace tandem::lab
