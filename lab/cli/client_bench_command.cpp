// `tandem-lab bench client`: what one haptic tick takes with everything on, in a session with server and link, beside
// the same session with nothing on and beside what the machine takes for a fixed computation.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "lab/cli/bench_commands.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "lab/experiment/quantities.hpp"
#include "lab/report/check.hpp"
#include "lab/session/client_bench.hpp"

namespace tandem::lab {
namespace {

/// Of the 1000 µs of a tick. What is left is the device's own and the machine's: USB, wake-up, network.
struct Claim {
  const char* experiment;
  double tick_p99_us;
};
constexpr std::array kClaims{Claim{"bunny", 150}, Claim{"wall", 20}};
/// Off the path, but on the thread that has the sockets: what comes from the server waits for it.
constexpr double kFitMedian_us = 200;

struct Variant {
  const char* name;
  const char* stage;
  const char* predictor;
  bool passivity;
};
constexpr Variant kFull{"everything", "local-model", "ar-spline", true};
constexpr Variant kPeer{"late-pose", "late-pose", "none", false};

struct Options {
  double rtt_ms = 50;
  std::size_t repetitions = 3;
  bool has_check = false;
  bool wants_json = false;
};

/// Runs of one experiment, with everything on and with nothing, in turn: a change of the clock rate meets both.
struct Row {
  Claim claim{};
  std::vector<ClientBenchRun> full;
  std::vector<ClientBenchRun> peer;
};

double microseconds(Duration duration) {
  return to_seconds(duration) * 1e6;
}

/// Median over the repetitions of a quantile of each: one that something else held up does not decide.
double quantile_us(const std::vector<ClientBenchRun>& runs, Histogram ClientBenchRun::*of, double q) {
  std::vector<double> values;
  for (const ClientBenchRun& run : runs) values.push_back(microseconds((run.*of).quantile(q)));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Experiment experiment_of(const Claim& claim, const Variant& variant, const Options& options) {
  const std::vector<std::string> names{claim.experiment};
  ExperimentFile file = read_experiment_file(experiment_files(names).front());
  set_quantity(file.document, "stage", variant.stage);
  set_quantity(file.document, "predictor", variant.predictor);
  set_quantity(file.document, "passivity", variant.passivity);
  set_quantity(file.document, "link.rtt_ms", options.rtt_ms);
  return parse_experiment(file);
}

Row measured(const Claim& claim, const Options& options) {
  const Experiment full = experiment_of(claim, kFull, options);
  const Experiment peer = experiment_of(claim, kPeer, options);
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  const auto scene = load_experiment_scene(full, loading);
  Row row;
  row.claim = claim;
  for (std::size_t i = 0; i < options.repetitions; ++i) {
    row.full.push_back(bench_client(full, scene));
    row.peer.push_back(bench_client(peer, scene));
  }
  return row;
}

std::vector<Check> checks_of(const std::vector<Row>& rows) {
  std::vector<Check> checks;
  for (const Row& row : rows) {
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

boost::json::object to_json(const Options& options, const std::vector<Row>& rows, const std::vector<Check>& checks) {
  boost::json::array experiments;
  for (const Row& row : rows) {
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

void print(const Options& options, const std::vector<Row>& rows, const std::vector<Check>& checks) {
  std::cout << "one haptic tick [µs], clock reading included; round trip " << options.rtt_ms << " ms; medians over "
            << options.repetitions << " runs\n";
  for (const Row& row : rows) {
    std::cout << "\n"
              << std::left << std::setw(46) << row.claim.experiment
              << "    times       p50       p99     p99.9       max\n";
    print_line("tick: local-model, ar-spline, passivity", row.full, &ClientBenchRun::tick);
    print_line("tick: late-pose", row.peer, &ClientBenchRun::tick);
    print_line("fit off the path", row.full, &ClientBenchRun::fit);
    print_line("the machine: a fixed computation", row.full, &ClientBenchRun::work);
    print_line("the machine: reading the clock", row.full, &ClientBenchRun::clock);
    std::cout << "  force up to " << row.full.front().force_max_n << " N; the local model had the hand in "
              << 100 * row.full.front().local_share << " % of the ticks\n";
  }
  std::cout << '\n';
  print_checks(std::cout, checks);
}

int run(const Options& options) {
  std::vector<Row> rows;
  for (const Claim& claim : kClaims) rows.push_back(measured(claim, options));
  const std::vector<Check> checks = checks_of(rows);
  if (options.wants_json) {
    std::cout << pretty_json(to_json(options, rows, checks));
  } else {
    print(options, rows, checks);
  }
  return !options.has_check || all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_client_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command =
      bench.add_subcommand("client", "One haptic tick with everything on, in a session in virtual time");
  command->add_option("--rtt-ms", options->rtt_ms, "round trip of the simulated link [ms]")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--repetitions", options->repetitions, "runs of which the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_flag("--check", options->has_check, "exit code 1 when a time is above its bound");
  command->add_flag("--json", options->wants_json, "print JSON instead of a table");
  command->footer("Exit code: 0 done, 1 a bound does not hold and --check is given, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tandem::lab
