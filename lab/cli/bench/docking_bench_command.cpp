// `tandem-lab bench docking`: measures one evaluation of the molecular field for two structures. The rate is reported
// as a fraction of the multiply-add rate that this machine reaches in the same run. Options select the number of atoms
// at the interface: one number or several.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/time.hpp"
#include "common/docking/far_grid.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/cli/docking_pair.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/studies/docking/field_scaling.hpp"
#include "lab/studies/docking/interface.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

/// Number of poses in a round, all different. The ligand oscillates by ±0.5 Å. It also rotates so slightly that its far
/// end moves by a similar distance.
constexpr int kPoses = 16;
constexpr double kSwingAngstrom = 0.5;
constexpr double kTurnRad = 0.01;
/// Number of rounds. The multiply-add rate is measured between the rounds, so that a change of the processor's clock
/// rate affects both measurements.
constexpr int kDockingRounds = 10;
constexpr std::size_t kLimitLoops = 200'000;

struct DockingBenchOptions {
  DockingOptions pair;
  std::string kernel;
  std::size_t interface_atoms = 0;
  std::string out;
  double seconds = 2;
  bool runs_sweep = false;
  bool runs_far_grid = false;
  bool prints_json = false;
};

/// A sweep runs with several interface sizes: --interface-atoms divided by each of these numbers.
constexpr std::size_t kSweepParts[] = {32, 16, 8, 4, 2, 1};

/// Returns the number of multiply-adds per second in one run. The limit of the machine is the maximum over the rounds.
double multiply_adds_per_s(std::string_view kernel, const SteadyClock& clock) {
  const LocalTime begin = clock.now();
  const auto done = static_cast<double>(docking::MolecularField::run_multiply_adds(kernel, kLimitLoops));
  return done / to_seconds(clock.now() - begin);
}

std::vector<Pose> poses_about(const docking::Molecule& ligand, const Pose& X_AB) {
  const Vec3 centre = ligand.centre_of_mass_angstrom();
  double radius = 0;
  for (const Vec3& p : ligand.positions_angstrom) radius = std::max(radius, (p - centre).norm());
  const double turn = std::min(kTurnRad, kSwingAngstrom / radius);
  std::vector<Pose> poses;
  for (int i = 0; i < kPoses; ++i) {
    const double phase = 2 * std::numbers::pi * i / kPoses;
    Pose X = X_AB;
    X.q = quaternion_of(turn * Vec3(std::sin(phase), 0, std::cos(phase))) * X_AB.q;
    X.p = X_AB * centre - X.q * centre + kSwingAngstrom * Vec3(std::sin(phase), std::cos(phase), std::sin(2 * phase));
    poses.push_back(X);
  }
  return poses;
}

double reach_of(const docking::FieldModel& model) {
  return model.cutoff_angstrom > 0 ? model.cutoff_angstrom : docking::kUsualCutoffAngstrom;
}

json::object measured(const DockingPair& pair, docking::MolecularField& field, const Pose& X_AB, double for_seconds) {
  const std::vector<Pose> poses = poses_about(pair.ligand, X_AB);
  const SteadyClock clock;
  Histogram times;
  double limit = 0, energy = 0, pairs = 0, multiply_adds = 0;
  for (const Pose& X : poses) {
    energy += field.evaluate(X).energy_kj_per_mol();
    pairs += static_cast<double>(field.pair_count()) / kPoses;
    multiply_adds += static_cast<double>(field.multiply_adds()) / kPoses;
  }
  for (int round = 0; round < kDockingRounds; ++round) {
    limit = std::max(limit, multiply_adds_per_s(field.kernel(), clock));
    const LocalTime end = clock.now() + from_seconds(for_seconds / kDockingRounds);
    do {
      for (const Pose& X : poses) {
        const LocalTime begin = clock.now();
        energy += field.evaluate(X).energy_kj_per_mol();
        times.record(clock.now() - begin);
      }
    } while (clock.now() < end);
  }
  if (!std::isfinite(energy)) throw std::runtime_error("kernel " + std::string(field.kernel()) + ": energy not finite");
  const double median_s = 1e-6 * microseconds(times.quantile(0.5));
  json::object row = interface_facts(pair.receptor, pair.ligand, X_AB, reach_of(pair.model));
  row["pairs"] = std::llround(pairs);
  row["evaluations"] = times.count();
  row["eval_us"] =
      json::object{{"p50", microseconds(times.quantile(0.5))}, {"p99", microseconds(times.quantile(0.99))}};
  row["gpairs_per_s"] = 1e-9 * pairs / median_s;
  row["multiply_adds"] = std::llround(multiply_adds);
  row["limit_gmultiply_adds_per_s"] = 1e-9 * limit;
  row["share_of_limit"] = multiply_adds / median_s / limit;
  return row;
}

/// Returns the error that the far-field grid causes, as the RMS over the poses. The reference is the sum over all pairs
/// of atoms without cut-off.
json::object far_part(const DockingPair& pair, docking::MolecularField& field, const Pose& X_AB) {
  docking::FieldModel model = pair.model;
  model.has_far_grid = false;
  docking::MolecularField near(pair.receptor, pair.ligand, model, field.kernel());
  model.cutoff_angstrom = 0;
  docking::MolecularField all(pair.receptor, pair.ligand, model, field.kernel());
  double energy = 0, energy_error = 0, force = 0, force_error = 0;
  const SteadyClock clock;
  Histogram of_all;
  for (const Pose& X : poses_about(pair.ligand, X_AB)) {
    const LocalTime begin = clock.now();
    const docking::FieldResult exact = all.evaluate(X);
    of_all.record(clock.now() - begin);
    const docking::FieldResult with = field.evaluate(X), near_only = near.evaluate(X);
    energy += std::pow(exact.energy_kj_per_mol() - near_only.energy_kj_per_mol(), 2);
    energy_error += std::pow(exact.energy_kj_per_mol() - with.energy_kj_per_mol(), 2);
    force += (exact.force_on_b - near_only.force_on_b).squaredNorm();
    force_error += (exact.force_on_b - with.force_on_b).squaredNorm();
  }
  return {{"energy_kj_mol", std::sqrt(energy / kPoses)},
          {"energy_error_kj_mol", std::sqrt(energy_error / kPoses)},
          {"force_kj_mol_angstrom", std::sqrt(force / kPoses)},
          {"force_error_kj_mol_angstrom", std::sqrt(force_error / kPoses)},
          {"all_pairs_us", microseconds(of_all.quantile(0.5))}};
}

std::vector<Pose> poses_of(const DockingBenchOptions& options, const DockingPair& pair) {
  if (options.interface_atoms == 0) return {Pose{}};
  std::vector<std::size_t> sizes;
  for (const std::size_t part : kSweepParts) {
    const std::size_t size = options.interface_atoms / part;
    if (size > 0 && (options.runs_sweep || part == 1)) sizes.push_back(size);
  }
  return poses_by_interface(pair.receptor, pair.ligand, reach_of(pair.model), sizes);
}

void print_row(const json::object& row) {
  const json::object& times = row.at("eval_us").as_object();
  const json::value& shortest = row.at("min_distance_angstrom");
  std::printf("%lld atoms in the interface (shortest distance %s Å), %lld pairs within reach, %lld computed\n",
              static_cast<long long>(row.at("interface_atoms").to_number<std::int64_t>()),
              shortest.is_null() ? "> reach:" : format_fixed(shortest.as_double(), 2).c_str(),
              static_cast<long long>(row.at("pairs_within").to_number<std::int64_t>()),
              static_cast<long long>(row.at("pairs").to_number<std::int64_t>()));
  std::printf("  %.4g us, p99 %.4g us; %.3g Gpair/s, %.0f %% of %.4g G multiply-adds/s\n", times.at("p50").as_double(),
              times.at("p99").as_double(), row.at("gpairs_per_s").as_double(),
              100 * row.at("share_of_limit").as_double(), row.at("limit_gmultiply_adds_per_s").as_double());
}

void print_far_part(const json::object& part) {
  const auto number = [&part](const char* key) { return part.at(key).as_double(); };
  std::printf(
      "  beyond the cut-off %.4g kJ/mol, force %.4g kJ/mol/Å; the grid misses %.2g kJ/mol and %.2g kJ/mol/Å of it; "
      "all pairs take %.4g us\n",
      number("energy_kj_mol"), number("force_kj_mol_angstrom"), number("energy_error_kj_mol"),
      number("force_error_kj_mol_angstrom"), number("all_pairs_us"));
}

void run_docking_bench(const DockingBenchOptions& options) {
  DockingPair pair = load_docking_pair(options.pair);
  if (options.runs_far_grid) {
    pair.model.has_far_grid = true;
    if (options.pair.cutoff == "auto") pair.model.cutoff_angstrom = docking::kUsualCutoffAngstrom;
    docking::validate(pair.model);
  }
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  docking::MolecularField field(pair.receptor, pair.ligand, pair.model, options.kernel);
  const double set_up_ms = 1e-3 * microseconds(clock.now() - begin);
  json::object result{{"atoms_receptor", pair.receptor.size()},
                      {"atoms_ligand", pair.ligand.size()},
                      {"method", field.method()},
                      {"kernel", field.kernel()},
                      {"dielectric", options.pair.dielectric},
                      {"cutoff_angstrom", pair.model.cutoff_angstrom},
                      {"set_up_ms", set_up_ms}};
  const std::string title = std::to_string(pair.receptor.size()) + " x " + std::to_string(pair.ligand.size()) +
                            " atoms, " + std::string(field.method()) + ", kernel " + std::string(field.kernel());
  if (!options.prints_json) std::cout << title << std::endl;
  if (const docking::FarGrid* const grid = field.far_grid()) {
    result["grid"] = json::object{{"spacing_angstrom", spacing_angstrom(*grid)}, {"nodes", node_count(*grid)}};
    if (!options.prints_json) {
      std::printf("grid of %zu nodes, %.2f Å apart; set up in %.0f ms\n", node_count(*grid), spacing_angstrom(*grid),
                  set_up_ms);
    }
  } else if (pair.model.has_far_grid && !options.prints_json) {
    std::printf("no grid: the larger molecule is too large for one\n");
  }
  json::array rows;
  for (const Pose& X_AB : poses_of(options, pair)) {
    json::object row = measured(pair, field, X_AB, options.seconds);
    if (field.far_grid() != nullptr) row["far_part"] = far_part(pair, field, X_AB);
    if (!options.prints_json) {
      print_row(row);
      if (row.contains("far_part")) print_far_part(row.at("far_part").as_object());
    }
    rows.emplace_back(std::move(row));
  }
  if (options.runs_sweep) {
    result["rows"] = rows;
  } else {
    for (const auto& [name, value] : rows.front().as_object()) result[name] = value;
  }
  if (options.prints_json) std::cout << pretty_json(result);
  if (options.out.empty()) return;
  write_all_files(options.out,
                  with_report({{"docking-scaling.json", pretty_json(result)}}, field_scaling_report(title, rows)));
}

}  // namespace

void add_docking_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<DockingBenchOptions>();
  CLI::App* const command = bench.add_subcommand("docking", "The molecular field of two structure files");
  options->pair.cutoff = "auto";
  add_docking_options(*command, options->pair);
  command->add_option("--kernel", options->kernel, "avx512, avx2 or portable; default: the widest");
  auto* const interface_atoms = command->add_option("--interface-atoms", options->interface_atoms,
                                                    "move the ligand until this many atoms of both are within the "
                                                    "cut-off (8 Å without) of the other; default: as in the files");
  interface_atoms->check(CLI::Range(std::size_t{1}, std::size_t{1'000'000}));
  auto* const sweep =
      command->add_flag("--sweep", options->runs_sweep, "likewise for 1/32, 1/16, … of them: cost against interface");
  sweep->needs(interface_atoms);
  command->add_flag("--far-grid", options->runs_far_grid,
                    "compute the part beyond the cut-off from a grid about the larger molecule");
  command->add_option("--out", options->out, "of a sweep: folder for docking-scaling.json and report.html")
      ->needs(sweep);
  command->add_option("--seconds", options->seconds, "time to measure, of each pose [s]")
      ->check(CLI::Range(0.01, 600.0))
      ->capture_default_str();
  command->add_flag("--json", options->prints_json, "print JSON");
  command->callback([options, &exit_code] {
    run_docking_bench(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab
