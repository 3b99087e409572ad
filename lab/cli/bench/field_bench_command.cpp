// `tandem-lab bench field`: measures the speed of a scene's molecular field on this machine. Each kernel is compared
// with the double-precision kernel in the same run at the same poses.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <iostream>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment.hpp"

namespace tandem::lab {
namespace {

/// Number of rounds. The kernels alternate, so that a change of the processor's clock rate affects all of them. The
/// median over the rounds is reported.
constexpr int kFieldRounds = 5;
/// Number of poses in a round. Molecule B oscillates by ±1 Å, as during docking, so that the branches of the kernels
/// vary.
constexpr int kFieldPoses = 16;

struct FieldBenchOptions {
  std::string scene = "docking_helices";
  double seconds = 0.5;
  bool prints_json = false;
};

struct FieldPair {
  std::shared_ptr<const server::LoadedScene> scene;
  const docking::Molecule* a = nullptr;
  const docking::Molecule* b = nullptr;
  Pose X_AB_angstrom;
};

struct FieldBenchContestant {
  std::string kernel;
  std::string precision;
  std::size_t pairs = 0;
  std::function<docking::FieldResult(const Pose&)> evaluate;
  std::vector<double> seconds_per_evaluation;  ///< one value for each round
};

FieldPair first_pair(const FieldBenchOptions& options) {
  FieldPair pair;
  pair.scene = server::load_scene(scene_path(options.scene, ""));
  const physics::BodyDescription* body_a = nullptr;
  for (const physics::BodyDescription& body : pair.scene->world.bodies) {
    if (!body.molecule) continue;
    if (body_a == nullptr) {
      body_a = &body;
      continue;
    }
    const double metres_per_angstrom = pair.scene->description.molecular_field().metres_per_angstrom();
    pair.a = body_a->molecule.get();
    pair.b = body.molecule.get();
    pair.X_AB_angstrom = body_a->X_WB.inverse() * body.X_WB;
    pair.X_AB_angstrom.p /= metres_per_angstrom;
    return pair;
  }
  throw std::invalid_argument("--scene " + options.scene +
                              ": it has fewer than two molecules; choose a docking scene, e.g. docking_helices");
}

std::vector<Pose> poses_around(const Pose& X_AB) {
  std::vector<Pose> poses;
  for (int i = 0; i < kFieldPoses; ++i) {
    Pose X = X_AB;
    X.p.x() += std::sin(2 * std::numbers::pi * i / kFieldPoses);
    poses.push_back(X);
  }
  return poses;
}

std::vector<FieldBenchContestant> contestants_for(const FieldPair& pair) {
  std::vector<FieldBenchContestant> contestants;
  contestants.push_back({"exact",
                         "double",
                         pair.a->size() * pair.b->size(),
                         [&pair](const Pose& X) { return docking::exact_field(*pair.a, *pair.b, X); },
                         {}});
  for (const std::string_view kernel : docking::MolecularField::available_kernels()) {
    const auto field = std::make_shared<docking::MolecularField>(*pair.a, *pair.b, docking::FieldModel{}, kernel);
    contestants.push_back({std::string(kernel),
                           "float pairs, double sums",
                           field->pair_count(),
                           [field](const Pose& X) { return field->evaluate(X); },
                           {}});
  }
  return contestants;
}

void run_round(FieldBenchContestant& contestant, const std::vector<Pose>& poses, double seconds) {
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  const LocalTime end = begin + from_seconds(seconds);
  std::size_t evaluations = 0;
  double energy_sum = 0;
  do {
    for (const Pose& X : poses) energy_sum += contestant.evaluate(X).energy_kj_per_mol();
    evaluations += poses.size();
  } while (clock.now() < end);
  if (!std::isfinite(energy_sum)) throw std::runtime_error("kernel " + contestant.kernel + " gave an infinite energy");
  contestant.seconds_per_evaluation.push_back(to_seconds(clock.now() - begin) / static_cast<double>(evaluations));
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

boost::json::object report(const FieldBenchOptions& options, const FieldPair& pair,
                           const std::vector<FieldBenchContestant>& contestants) {
  const double exact_s = median(contestants.front().seconds_per_evaluation);
  const double exact_energy = contestants.front().evaluate(pair.X_AB_angstrom).energy_kj_per_mol();
  boost::json::array rows;
  for (const FieldBenchContestant& contestant : contestants) {
    const double seconds = median(contestant.seconds_per_evaluation);
    const double energy = contestant.evaluate(pair.X_AB_angstrom).energy_kj_per_mol();
    rows.push_back(boost::json::object{{"kernel", contestant.kernel},
                                       {"precision", contestant.precision},
                                       {"pairs", contestant.pairs},
                                       {"gpairs_per_s", static_cast<double>(contestant.pairs) / seconds * 1e-9},
                                       {"us_per_evaluation", seconds * 1e6},
                                       {"times_faster_than_exact", exact_s / seconds},
                                       {"relative_energy_error", std::abs(energy / exact_energy - 1)}});
  }
  return {{"scene", options.scene},
          {"atoms_a", pair.a->size()},
          {"atoms_b", pair.b->size()},
          {"energy_kj_per_mol", exact_energy},
          {"kernels", rows}};
}

void print_table(const boost::json::object& result) {
  std::ostringstream text;
  text << result.at("scene").as_string().c_str() << ": " << result.at("atoms_a") << " x " << result.at("atoms_b")
       << " atoms\n\nkernel          Gpair/s   us/evaluation   times exact   energy error\n"
       << std::setprecision(3);
  for (const auto& row : result.at("kernels").as_array()) {
    const auto& fields = row.as_object();
    text << std::left << std::setw(12) << fields.at("kernel").as_string().c_str() << std::right << std::setw(11)
         << fields.at("gpairs_per_s").as_double() << std::setw(16) << fields.at("us_per_evaluation").as_double()
         << std::setw(14) << fields.at("times_faster_than_exact").as_double() << std::setw(15)
         << fields.at("relative_energy_error").as_double() << '\n';
  }
  std::cout << text.str();
}

void run_field_bench(const FieldBenchOptions& options) {
  const FieldPair pair = first_pair(options);
  std::vector<FieldBenchContestant> contestants = contestants_for(pair);
  const std::vector<Pose> poses = poses_around(pair.X_AB_angstrom);
  for (int round = 0; round < kFieldRounds; ++round) {
    for (FieldBenchContestant& contestant : contestants) run_round(contestant, poses, options.seconds / kFieldRounds);
  }
  const boost::json::object result = report(options, pair, contestants);
  if (options.prints_json) {
    std::cout << pretty_json(result);
  } else {
    print_table(result);
  }
}

}  // namespace

void add_field_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<FieldBenchOptions>();
  CLI::App* field = bench.add_subcommand("field", "The Lennard-Jones field of a scene's first two molecules");
  field->add_option("--scene", options->scene, "name of a shipped docking scene, or path of a scene file")
      ->capture_default_str();
  field->add_option("--seconds", options->seconds, "time spent on each kernel [s]")
      ->check(CLI::Range(0.01, 600.0))
      ->capture_default_str();
  field->add_flag("--json", options->prints_json, "print JSON instead of a table");
  field->callback([options, &exit_code] {
    run_field_bench(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab
