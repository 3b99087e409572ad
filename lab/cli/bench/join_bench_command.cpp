// `tandem-lab bench join`: measures the time until a user who joins over a slow line has a local model, and the delay
// of states while assets share that line. Two further runs serve as comparison: a client that fetches one chunk at a
// time, and a client that has all assets from the start.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "lab/session/join_trial.hpp"

namespace tandem::lab {
namespace {

/// Duration of a trial as a multiple of the time that the line needs to transfer the assets.
constexpr double kTimesTheAssets = 3;
constexpr double kBitsPerByte = 8;

struct JoinBenchOptions {
  std::string experiment = "bunny";
  std::vector<double> rates_mbit_per_s{10, 1};
  std::vector<double> losses{0, 0.02};
  double rtt_ms = 50;
  double jitter_ms = 0;
  bool prints_json = false;
};

/// Properties of one line, and the results of joining over it, one for each way of delivering the assets.
struct JoinBenchRow {
  double rate_mbit_per_s = 0;
  double loss = 0;
  std::vector<JoinFigures> ways;
};

double touch_bytes(const server::LoadedScene& scene) {
  double bytes = 0;
  for (const server::Asset& asset : scene.assets) {
    if (asset.kind == "contact" || asset.kind == "molecule") bytes += static_cast<double>(asset.bytes->size());
  }
  return bytes;
}

JoinBenchRow measure_join_bench(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                                const JoinBenchOptions& options, double rate_mbit_per_s, double loss) {
  const double bytes_per_s = rate_mbit_per_s * 1e6 / kBitsPerByte;
  for (ExperimentUser& user : experiment.users) {
    user.up.delay = user.down.delay = from_seconds(options.rtt_ms / 2e3);
    user.up.jitter = user.down.jitter = from_seconds(options.jitter_ms / 1e3);
    user.up.loss = user.down.loss = loss;
    user.up.rate_limit_bytes_per_s = user.down.rate_limit_bytes_per_s = bytes_per_s;
  }
  experiment.duration =
      std::max(experiment.duration, from_seconds(kTimesTheAssets * touch_bytes(*scene) / bytes_per_s));
  return {rate_mbit_per_s, loss, measure_join(experiment, scene)};
}

boost::json::value json_of(const std::optional<double>& number) {
  return number ? boost::json::value(*number) : boost::json::value();
}

boost::json::object json_of(const JoinBenchRow& row) {
  boost::json::array ways;
  for (const JoinFigures& way : row.ways) {
    ways.push_back({{"assets", way.assets},
                    {"local_after_s", json_of(way.local_after_s)},
                    {"full_local_after_s", json_of(way.full_local_after_s)},
                    {"stream_bytes", way.stream_bytes},
                    {"state_wait_p99_ms", way.wait_p99_ms},
                    {"state_wait_max_ms", way.wait_max_ms},
                    {"states_per_s", way.states_per_s},
                    {"coarse_touch_ticks", way.coarse_ticks},
                    {"coarse_force_error_percent", 100 * way.coarse_force_share},
                    {"coarse_apart_mm", way.coarse_mm},
                    {"force_step_n", way.step_n},
                    {"usual_force_step_n", way.usual_step_n}});
  }
  return {{"rate_mbit_per_s", row.rate_mbit_per_s}, {"loss", row.loss}, {"ways", ways}};
}

void print_row(std::ostream& out, const JoinBenchRow& row) {
  for (const JoinFigures& way : row.ways) {
    out << std::setw(7) << row.rate_mbit_per_s << std::setw(5) << 100 * row.loss << " %  " << std::left << std::setw(16)
        << way.assets << std::right << std::fixed << std::setprecision(2);
    for (const std::optional<double>& after_s : {way.local_after_s, way.full_local_after_s}) {
      out << std::setw(10);
      after_s ? out << *after_s : out << "never";
    }
    out << std::setw(8) << way.stream_bytes / 1e6 << std::setw(13) << way.wait_p99_ms << std::setw(9) << way.wait_max_ms
        << std::setprecision(0) << std::setw(10) << way.states_per_s << '\n'
        << std::defaultfloat << std::setprecision(6);
  }
}

void run_join_bench(const JoinBenchOptions& options) {
  const std::array<std::string, 1> names{options.experiment};
  const Experiment experiment = load_experiment(experiment_files(names).front());
  const auto scene = load_experiment_scene(experiment);
  std::vector<JoinBenchRow> rows;
  for (const double rate : options.rates_mbit_per_s) {
    for (const double loss : options.losses) rows.push_back(measure_join_bench(experiment, scene, options, rate, loss));
  }
  if (options.prints_json) {
    boost::json::array lines;
    for (const JoinBenchRow& row : rows) lines.push_back(json_of(row));
    std::cout << pretty_json(boost::json::object{{"experiment", options.experiment},
                                                 {"rtt_ms", options.rtt_ms},
                                                 {"jitter_ms", options.jitter_ms},
                                                 {"assets_bytes", touch_bytes(*scene)},
                                                 {"lines", lines}});
    return;
  }
  std::cout << options.experiment << ", " << options.rtt_ms << " ms round trip, "
            << std::llround(touch_bytes(*scene) / 1e3) << " kB of assets for touch\n\n"
            << " Mbit/s  loss  assets           touch [s]  full [s]      MB  wait p99 [ms]  max [ms]  states/s\n";
  for (const JoinBenchRow& row : rows) print_row(std::cout, row);
}

}  // namespace

void add_join_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<JoinBenchOptions>();
  CLI::App* join = bench.add_subcommand("join", "Joining over a line that state and assets share, in virtual time");
  join->add_option("--experiment", options->experiment, "an experiment's name or file; its first user is measured")
      ->capture_default_str();
  join->add_option("--rate-mbit", options->rates_mbit_per_s, "of the line, each way [Mbit/s]")
      ->check(CLI::Range(0.2, 10'000.0))
      ->capture_default_str();
  join->add_option("--loss", options->losses, "share of datagrams lost each way; control is not lost")
      ->check(CLI::Range(0.0, net::kMaxLoss))
      ->capture_default_str();
  join->add_option("--rtt-ms", options->rtt_ms, "round trip [ms]")
      ->check(CLI::Range(0.0, 2000.0))
      ->capture_default_str();
  join->add_option("--jitter-ms", options->jitter_ms, "of each way [ms]")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  join->add_flag("--json", options->prints_json, "print JSON instead of a table");
  join->footer(
      "touch: from joining to the first touch by a local model; full: with the whole assets, which coarse "
      "ones\nreplace until then; wait: of the server's state for the line, until then (in the whole trial if no asset "
      "is missing).");
  join->callback([options, &exit_code] {
    run_join_bench(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab
