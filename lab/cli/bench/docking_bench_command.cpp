// `tandem-lab bench docking`: how long one evaluation of two structures' field takes, beside how many multiply-adds
// this machine does in the same run.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/time.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/cli/docking_pair.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

/// Poses in a round: the ligand swings by ±0.5 Å and turns a little, so that nothing is the same twice.
constexpr int kPoses = 16;
/// Between the rounds the limit is measured, so that a change of the clock rate meets both.
constexpr int kRounds = 10;
constexpr std::size_t kLimitLoops = 200'000;

struct Options {
  DockingOptions pair;
  std::string kernel;
  double seconds = 2;
  bool wants_json = false;
};

/// Best of the rounds, as a limit has to be.
double multiply_adds_per_s(std::string_view kernel, const SteadyClock& clock) {
  const LocalTime begin = clock.now();
  const auto done = static_cast<double>(docking::MolecularField::run_multiply_adds(kernel, kLimitLoops));
  return done / to_seconds(clock.now() - begin);
}

std::vector<Pose> poses_about(const docking::Molecule& ligand) {
  const Vec3 centre = ligand.centre_of_mass_angstrom();
  std::vector<Pose> poses;
  for (int i = 0; i < kPoses; ++i) {
    const double phase = 2 * std::numbers::pi * i / kPoses;
    Pose X;
    X.q = quaternion_of(Vec3(0.01 * std::sin(phase), 0, 0.01 * std::cos(phase)));
    X.p = centre - X.q * centre + 0.5 * Vec3(std::sin(phase), std::cos(phase), std::sin(2 * phase));
    poses.push_back(X);
  }
  return poses;
}

json::object measured(const Options& options) {
  const DockingPair pair = load_docking_pair(options.pair);
  docking::MolecularField field(pair.receptor, pair.ligand, pair.model, options.kernel);
  const std::vector<Pose> poses = poses_about(pair.ligand);
  const SteadyClock clock;
  Histogram times;
  double limit = 0, energy = 0, pairs = 0, seconds = 0;
  for (const Pose& X : poses) energy += field.evaluate(X).energy_kj_per_mol();
  for (int round = 0; round < kRounds; ++round) {
    limit = std::max(limit, multiply_adds_per_s(field.kernel(), clock));
    const LocalTime end = clock.now() + from_seconds(options.seconds / kRounds);
    do {
      for (const Pose& X : poses) {
        const LocalTime begin = clock.now();
        energy += field.evaluate(X).energy_kj_per_mol();
        const Duration taken = clock.now() - begin;
        times.record(taken);
        seconds += to_seconds(taken);
        pairs += static_cast<double>(field.pair_count());
      }
    } while (clock.now() < end);
  }
  if (!std::isfinite(energy)) throw std::runtime_error("kernel " + std::string(field.kernel()) + ": energy not finite");
  return {{"atoms_receptor", pair.receptor.size()},
          {"atoms_ligand", pair.ligand.size()},
          {"pairs", field.pair_count()},
          {"method", field.method()},
          {"kernel", field.kernel()},
          {"dielectric", options.pair.dielectric},
          {"cutoff_angstrom", pair.model.cutoff_angstrom},
          {"evaluations", times.count()},
          {"eval_us",
           json::object{{"p50", microseconds(times.quantile(0.5))}, {"p99", microseconds(times.quantile(0.99))}}},
          {"gpairs_per_s", 1e-9 * pairs / seconds},
          {"limit_gmultiply_adds_per_s", 1e-9 * limit}};
}

void run(const Options& options) {
  const json::object result = measured(options);
  if (options.wants_json) {
    std::cout << pretty_json(result);
    return;
  }
  const json::object& times = result.at("eval_us").as_object();
  std::printf("%lld x %lld atoms, %s, kernel %s, %lld pairs\n",
              static_cast<long long>(result.at("atoms_receptor").to_number<std::int64_t>()),
              static_cast<long long>(result.at("atoms_ligand").to_number<std::int64_t>()),
              result.at("method").as_string().c_str(), result.at("kernel").as_string().c_str(),
              static_cast<long long>(result.at("pairs").to_number<std::int64_t>()));
  std::printf("%.4g us, p99 %.4g us; %.3g Gpair/s, at a limit of %.4g G multiply-adds/s\n", times.at("p50").as_double(),
              times.at("p99").as_double(), result.at("gpairs_per_s").as_double(),
              result.at("limit_gmultiply_adds_per_s").as_double());
}

}  // namespace

void add_docking_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command = bench.add_subcommand("docking", "The molecular field of two structure files");
  options->pair.cutoff = "auto";
  add_docking_options(*command, options->pair);
  command->add_option("--kernel", options->kernel, "avx512, avx2 or portable; default: the widest");
  command->add_option("--seconds", options->seconds, "time to measure [s]")
      ->check(CLI::Range(0.01, 600.0))
      ->capture_default_str();
  command->add_flag("--json", options->wants_json, "print JSON");
  command->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab
