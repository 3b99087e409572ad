#include "lab/studies/docking/redock.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/metrics/capri.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/session/virtual_session.hpp"
#include "lab/studies/docking/docking_trial.hpp"
#include "lab/studies/docking/exit_path.hpp"
#include "lab/studies/docking/parts_as_read.hpp"
#include "proto/scene_ranges.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::size_t kReceptorBody = 0, kLigandBody = 1;
constexpr Duration kRedockSettling{from_seconds(4)};
/// Duration of one step of the path. A step of 0.25 Å at a scale of 10 mm/Å gives a hand speed of 30 mm/s.
constexpr Duration kRedockPerPose{from_seconds(0.083)};
constexpr std::size_t kTriesBeforeLocked = 5;
/// Number of minimisations from poses around the native pose, in addition to the one from the native pose.
constexpr std::size_t kDescentsAround = 12;
/// Energy difference below which two minima are regarded as the same: a sixth of kT, which is 0.593 kcal/mol at 298 K.
constexpr double kSameMinimum_kcal_per_mol = 0.1;

struct RedockPair {
  wire::Scene scene;  ///< scene with its computed force scale
  std::shared_ptr<const server::LoadedScene> loaded;
  Pose X_AB_min;
  double minimum_kcal_per_mol = 0;
};

double rounded(double value) {
  return std::round(value * 1e4) / 1e4;
}

const docking::Molecule& molecule_of(const RedockPair& pair, std::size_t body) {
  return *pair.loaded->world.bodies[body].molecule;
}

/// Returns the deepest minimum found within kNative_angstrom of the native pose; if there is none, the minimum reached
/// from the native pose. Minimisations also start around the native pose, because the native pose alone may lead to a
/// shallow side pocket of the native well. A ligand that enters from outside would not reach that pocket.
std::pair<Pose, double> deepest_near_native(const server::LoadedScene& scene) {
  const docking::Molecule& ligand = *scene.world.bodies[kLigandBody].molecule;
  const auto is_near = [&](const Pose& X_AB) {
    return ligand_rmsd_angstrom(ligand, X_AB, native_pose(scene)) <= kNative_angstrom;
  };
  std::pair<Pose, double> deepest = native_minimum(scene);
  for (const auto& minimum : minima_around_native(scene, kDescentsAround, kRelease_angstrom, 1)) {
    if (!is_near(minimum.first)) continue;
    const bool is_first = !is_near(deepest.first);
    if (is_first || minimum.second < deepest.second - kSameMinimum_kcal_per_mol) deepest = minimum;
  }
  return deepest;
}

RedockPair pair_of(wire::Scene scene, const Pose& start) {
  RedockPair pair;
  pair.loaded = scene_with_ligand_at(scene, start);
  const docking::Molecule &receptor = molecule_of(pair, kReceptorBody), &ligand = molecule_of(pair, kLigandBody);
  const Pose native = native_pose(*pair.loaded);
  require_complex_as_read(receptor, ligand, native);
  pair.scene = with_found_scale(std::move(scene), *pair.loaded);
  std::tie(pair.X_AB_min, pair.minimum_kcal_per_mol) = deepest_near_native(*pair.loaded);
  if (!(pair.minimum_kcal_per_mol <= -kHardlyHeld_kcal_per_mol)) {
    throw std::invalid_argument(
        "receptor and ligand are no complex: near where their files have them the least energy is " +
        proto::number_text(rounded(pair.minimum_kcal_per_mol)) + " kcal/mol, and it must be " +
        proto::number_text(-kHardlyHeld_kcal_per_mol) + " at most; " +
        distance_text(receptor, ligand, native, *nearest_atoms(receptor, ligand, native)) +
        "; name two parts of one complex, and give --hydrogens build where a file has some hydrogens only");
  }
  return pair;
}

double energy_kcal_per_mol(const RedockPair& pair, const Pose& X_AB) {
  const auto& bodies = pair.loaded->world.bodies;
  return docking::exact_field(*bodies[0].molecule, *bodies[1].molecule, X_AB, pair.loaded->world.field_model)
             .energy_kj_per_mol() /
         docking::kKilojoulesPerKilocalorie;
}

/// Returns the ligand's path back: from the end of the exit path to the pose at which the hands release the ligand.
std::vector<Pose> way_in(const RedockPair& pair, const std::vector<Pose>& way_out) {
  const docking::Molecule& ligand = molecule_of(pair, kLigandBody);
  const auto rmsd = [&](const Pose& X_AB) { return ligand_rmsd_angstrom(ligand, X_AB, pair.X_AB_min); };
  std::size_t last = 0;
  while (last + 2 < way_out.size() && rmsd(way_out[last]) < kRelease_angstrom) ++last;
  std::vector<Pose> way(way_out.begin() + static_cast<std::ptrdiff_t>(last), way_out.end());
  Pose nearer = way_out[last == 0 ? 0 : last - 1];
  while (rmsd(way.front()) > kFarthestRelease_angstrom) {
    const Pose middle = pose_between(nearer, way.front(), 0.5);
    (rmsd(middle) < kRelease_angstrom ? nearer : way.front()) = middle;
  }
  std::ranges::reverse(way);
  return way;
}

/// Returns the last sample of the bodies up to `time`.
const BodiesSample& bodies_at(const SessionTrace& trace, Duration time) {
  const auto after = std::ranges::upper_bound(trace.bodies, time, {}, &BodiesSample::time);
  return after == trace.bodies.begin() ? trace.bodies.front() : *std::prev(after);
}

double device_limit_n(const Experiment& experiment) {
  double limit = std::numeric_limits<double>::infinity();
  for (const ExperimentUser& user : experiment.users) limit = std::min(limit, user.device.spec.force_limit_n);
  return limit;
}

bool stayed(const SessionTrace& trace) {
  return std::ranges::all_of(trace.users, &UserTrace::stayed_connected);
}

bool is_out(const std::vector<Pose>& way_out) {
  return way_out_angstrom(way_out) >= kExitDistance_angstrom;
}

/// Returns the highest Lennard-Jones energy on a path.
double barrier_kcal_per_mol(const RedockPair& pair, const std::vector<Pose>& way) {
  docking::FieldModel model = pair.loaded->world.field_model;
  model.dielectric = docking::Dielectric::kNone;
  model.has_far_grid = false;
  const auto& bodies = pair.loaded->world.bodies;
  docking::MolecularField field(*bodies[0].molecule, *bodies[1].molecule, model);
  double highest = -std::numeric_limits<double>::infinity();
  for (const Pose& X_AB : way) highest = std::max(highest, field.evaluate(X_AB).lennard_jones_kj_per_mol);
  return highest / docking::kKilojoulesPerKilocalorie;
}

/// Adds the CAPRI measures of a pose of the ligand to a row, with names that begin with `prefix`.
void add_native_measures(json::object& row, const std::string& prefix, const RedockPair& pair, const Pose& X_AB) {
  const docking::Molecule &receptor = molecule_of(pair, kReceptorBody), &ligand = molecule_of(pair, kLigandBody);
  const Pose native = native_pose(*pair.loaded);
  row[prefix + "rmsd_to_native_angstrom"] = rounded(ligand_rmsd_angstrom(ligand, X_AB, native));
  row[prefix + "interface_rmsd_angstrom"] = rounded(interface_rmsd_angstrom(receptor, ligand, native, X_AB));
  row[prefix + "native_contact_share"] = rounded(native_contact_share(receptor, ligand, native, X_AB));
}

/// Returns the field "end" of a row: "docked", or the reason why the ligand is not docked.
std::string_view end_name(const RedockPair& pair, const json::object& row) {
  if (!row.at("stayed_connected").get_bool()) return "disconnected";
  if (row.at("docked").get_bool()) return "docked";
  const double above_kcal_per_mol = row.at("settled_above_minimum_kcal_per_mol").to_number<double>();
  if (above_kcal_per_mol < -kSameMinimum_kcal_per_mol) return "deeper minimum";
  // The zero area is a range of energies near the minimum without displayed force. Above it the force rises to its full
  // strength within 1 kT.
  const double zero_kt = pair.loaded->description.molecular_field().zero_area_kt();
  const bool is_in_zero_area =
      zero_kt > 0 && above_kcal_per_mol <= (zero_kt + 1) * docking::kThermalEnergy_kcal_per_mol;
  return is_in_zero_area ? "zero area" : "elsewhere";
}

json::object trial_row(const RedockPair& pair, const std::vector<Pose>& way_out, std::uint64_t seed,
                       Duration round_trip, bool guided) {
  json::object row{{"seed", seed},
                   {"out_angstrom", rounded(way_out_angstrom(way_out))},
                   {"poses", way_out.size()},
                   {"barrier_kcal_per_mol", rounded(barrier_kcal_per_mol(pair, way_out))}};
  if (!is_out(way_out)) return row;
  const std::vector<Pose> way = way_in(pair, way_out);
  const auto scene = scene_with_ligand_at(pair.scene, way.front());
  const devices::HandPath hand = ligand_hand(*scene, way, kRedockPerPose, !guided);
  Experiment experiment = docking_experiment(hand, !guided, round_trip, kRedockSettling, seed);
  const SessionTrace trace = run_virtual_session(experiment, scene);
  Experiment at_zero = docking_experiment(hand, !guided, Duration(0), kRedockSettling, seed);
  for (ExperimentUser& user : at_zero.users) user.pipeline.stage = experiment.reference_stage;
  const SessionTrace reference = run_virtual_session(at_zero, scene);

  const Pose released = ligand_pose(*scene, bodies_at(trace, settles_at(hand)));
  const Pose settled = ligand_pose(*scene, trace.bodies.back());
  const Pose settled_at_zero = ligand_pose(*scene, reference.bodies.back());
  const docking::Molecule& ligand = molecule_of(pair, kLigandBody);
  const auto rmsd = [&](const Pose& X_AB) { return rounded(ligand_rmsd_angstrom(ligand, X_AB, pair.X_AB_min)); };
  const TrialView view{experiment, trace, &reference, nullptr};
  row["intended_rmsd_angstrom"] = rmsd(way.back());
  row["released_rmsd_angstrom"] = rmsd(released);
  row["settled_rmsd_angstrom"] = rmsd(settled);
  row["settled_rmsd_at_zero_delay_angstrom"] = rmsd(settled_at_zero);
  row["settled_above_minimum_kcal_per_mol"] = rounded(energy_kcal_per_mol(pair, settled) - pair.minimum_kcal_per_mol);
  row["force_step_n_per_ms"] = rounded(force_step_n_per_ms(trace));
  row["force_step_at_zero_delay_n_per_ms"] = rounded(force_step_n_per_ms(reference));
  row["force_step_beyond_n_per_ms"] = rounded(trial_metric(view, "force_step_max_n_per_ms"));
  row["peak_force_n"] = rounded(peak_force_n(trace));
  row["device_limit_n"] = device_limit_n(experiment);
  row["virtual_s"] = rounded(to_seconds(experiment.duration));
  row["stayed_connected"] = stayed(trace);
  add_native_measures(row, "settled_", pair, settled);
  row["docked"] = stayed(trace) && rmsd(settled) <= kDocked_angstrom;
  row["end"] = end_name(pair, row);
  return row;
}

/// Runs job(0) … job(count − 1) on `threads` threads. Rethrows the first exception.
void for_each(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& job) {
  std::atomic<std::size_t> next{0};
  std::mutex failing;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        job(i);
      } catch (...) {
        const std::lock_guard lock(failing);
        if (failure == nullptr) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < std::min(threads, count); ++i) others.emplace_back(work);
  work();
  others.clear();
  if (failure != nullptr) std::rethrow_exception(failure);
}

json::object about(const RedockPair& pair, Duration round_trip, bool guided) {
  const docking::Molecule &receptor = molecule_of(pair, kReceptorBody), &ligand = molecule_of(pair, kLigandBody);
  const Pose native = native_pose(*pair.loaded);
  const wire::MolecularField& field = pair.loaded->description.molecular_field();
  json::object about{
      {"atoms_receptor", receptor.size()},
      {"atoms_ligand", ligand.size()},
      {"dielectric", field.dielectric()},
      {"cutoff_angstrom", field.cutoff_angstrom()},
      {"far_grid", field.far_grid()},
      {"zero_area_kt", field.zero_area_kt()},
      {"newtons_per_kcal_per_mol_angstrom", field.newtons_per_kcal_per_mol_angstrom()},
      {"native_contacts", residue_pairs_within(receptor, ligand, native, kResidueContact_angstrom).size()},
      {"native_nearest_atoms", distance_text(receptor, ligand, native, *nearest_atoms(receptor, ligand, native))},
      {"native_kcal_per_mol", rounded(energy_kcal_per_mol(pair, native))},
      {"minimum_kcal_per_mol", rounded(pair.minimum_kcal_per_mol)},
      {"round_trip_ms", to_seconds(round_trip) * 1e3},
      {"field_kernel", docking::MolecularField::default_kernel()},
      {"guided", guided},
      {"locked", false}};
  add_native_measures(about, "minimum_", pair, pair.X_AB_min);
  json::array& notes = about["notes"].emplace_array();
  for (const std::string& note : pair.loaded->notes_for_users) notes.emplace_back(note);
  return about;
}

docking::Molecule without_hydrogens(const docking::Molecule& molecule) {
  return part_of(molecule, [&](std::size_t i) { return molecule.elements[i] != "H" && molecule.elements[i] != "D"; });
}

/// Returns the object "lock", which explains why the ligand cannot leave: the end of the farthest path, the residues
/// that repel each other most strongly at this end, and the distance that the ligand reaches without hydrogen atoms.
json::object lock_of(const RedockPair& pair, const std::vector<std::vector<Pose>>& ways, std::uint64_t seed) {
  const auto& farthest = *std::ranges::max_element(
      ways, {}, [](const std::vector<Pose>& way) { return way.empty() ? 0.0 : way_out_angstrom(way); });
  const docking::Molecule &receptor = molecule_of(pair, kReceptorBody), &ligand = molecule_of(pair, kLigandBody);
  const std::vector<Pose> of_heavy_atoms = exit_path(without_hydrogens(receptor), without_hydrogens(ligand),
                                                     pair.loaded->world.field_model, pair.X_AB_min, seed);
  return {{"out_angstrom", rounded(way_out_angstrom(farthest))},
          {"against", strongest_repulsion_text(receptor, ligand, farthest.back())},
          {"out_without_hydrogens_angstrom", rounded(way_out_angstrom(of_heavy_atoms))}};
}

double number(const json::object& row, std::string_view name) {
  const json::value* const value = row.if_contains(name);
  return value != nullptr && value->is_number() ? value->to_number<double>() : std::nan("");
}

double greatest(const json::array& rows, std::string_view name) {
  double found = std::nan("");
  for (const json::value& row : rows) found = std::fmax(found, number(row.get_object(), name));
  return found;
}

}  // namespace

json::object redock(const wire::Scene& scene, std::uint64_t first_seed, std::size_t seeds, Duration round_trip,
                    bool guided, std::size_t threads, const std::function<void(double)>& progress) {
  const RedockPair pair = pair_of(scene, {Vec3(0, 0, 100), Quat::Identity()});
  const auto& bodies = pair.loaded->world.bodies;
  json::object result = about(pair, round_trip, guided);
  std::vector<std::vector<Pose>> ways(seeds);
  const auto find_way = [&](std::size_t i) {
    ways[i] = exit_path(*bodies[0].molecule, *bodies[1].molecule, pair.loaded->world.field_model, pair.X_AB_min,
                        first_seed + i);
  };
  const std::size_t tries = std::min(seeds, kTriesBeforeLocked);
  for_each(tries, threads, find_way);
  const bool is_locked = std::none_of(ways.begin(), ways.begin() + static_cast<std::ptrdiff_t>(tries), is_out);
  std::vector<json::object> rows(is_locked ? tries : seeds);
  std::size_t done = 0;
  std::mutex telling;
  for_each(rows.size(), threads, [&](std::size_t i) {
    if (ways[i].empty()) find_way(i);
    rows[i] = trial_row(pair, ways[i], first_seed + i, round_trip, guided);
    const std::lock_guard lock(telling);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(rows.size()));
  });
  result["locked"] = is_locked;
  if (is_locked) result["lock"] = lock_of(pair, ways, first_seed);
  json::array& kept = result["seeds"].emplace_array();
  for (json::object& row : rows) kept.emplace_back(std::move(row));
  return result;
}

std::vector<Check> redock_checks(const json::object& redocked) {
  const json::array& rows = redocked.at("seeds").get_array();
  const std::string scope = redocked.at("guided").get_bool() ? "redocking, hand guiding" : "redocking";
  std::vector<Check> checks{{scope, "ligand RMSD of the minimum to the native pose",
                             number(redocked, "minimum_rmsd_to_native_angstrom"), Relation::kAtMost, kNative_angstrom,
                             "Å", 2}};
  if (redocked.at("locked").get_bool()) {
    checks.push_back({scope, "farthest way out that was found", greatest(rows, "out_angstrom"), Relation::kAtLeast,
                      kExitDistance_angstrom, "Å", 2});
    return checks;
  }
  if (!redocked.at("guided").get_bool()) {
    const auto docked = std::ranges::count_if(rows, [](const json::value& row) {
      const json::value* const is_docked = row.get_object().if_contains("docked");
      return is_docked != nullptr && is_docked->get_bool();
    });
    checks.push_back({scope, "share of starts that settle within 1 Å of the minimum",
                      static_cast<double>(docked) / static_cast<double>(rows.size()), Relation::kAtLeast, kDockedShare,
                      "", 2});
  }
  checks.push_back({scope, "force step beyond zero delay's", greatest(rows, "force_step_beyond_n_per_ms"),
                    Relation::kAtMost, kStepBeyond_n_per_ms, "N/ms", 3});
  checks.push_back({scope, "greatest force shown", greatest(rows, "peak_force_n"), Relation::kAtMost,
                    greatest(rows, "device_limit_n"), "N", 2});
  return checks;
}

}  // namespace tandem::lab
