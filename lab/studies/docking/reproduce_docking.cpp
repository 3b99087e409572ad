#include "lab/studies/docking/reproduce_docking.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/metrics/high_pass.hpp"
#include "lab/report/format.hpp"
#include "lab/session/virtual_session.hpp"
#include "lab/studies/conventions.hpp"
#include "lab/studies/docking/docking_trial.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/molecular_scale.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kHelices = "/usr/share/pymol/test/dat/3al1.pdb";
using docking::kThermalEnergy_kcal_per_mol;
constexpr double kApart_angstrom = 8, kPressed_angstrom = 3, kPushed_angstrom = 8, kStep_angstrom = 0.25;
/// Durations of a trial: one step of the path (at a hand speed of 60 mm/s), the settling of the pair, and the time for
/// which both relaxed hands stay at the minimum.
constexpr Duration kPerPose{from_seconds(0.0417)}, kDockingSettling{from_seconds(2)}, kAlone{from_seconds(6)};
constexpr double kAloneFrom_s = 3;
constexpr double kTremor_n = 0.05;
constexpr std::uint64_t kSeeds = 5;
/// Factor by which the stable method must reduce the vibration of direct rendering. kTimesLessLightly applies to the
/// light contact without delay. In this condition direct rendering vibrates little, and its vibration depends on a few
/// atoms of the helices.
constexpr double kTimesLess = 10, kTimesLessLightly = 5;
/// The claims apply to the first kClaimed of the tested conditions (struct Condition).
constexpr std::size_t kClaimed = 3;
constexpr double kRate_hz = 1000;

/// Force displayed to the ligand's hand at each tick.
struct ShownDocking {
  std::vector<double> at_s;
  std::vector<Vec3> force_n;
  double vibration_rms_n = 0;  ///< RMS above kVibration_hz, all axes combined
  double peak_n = 0;
  double step_n_per_ms = 0;
};

struct PublishedPair {
  wire::Scene scene;
  Pose X_AB_min;
  double minimum_kcal_per_mol = 0;
  std::shared_ptr<const server::LoadedScene> loaded;
};

/// A condition under which both rendering methods are tested.
struct Condition {
  std::string name, published_direct, published_stable;
  std::string device;
  Duration round_trip{0};
  double deeper_angstrom = kPressed_angstrom;  ///< motion beyond first contact: how deep the hands press
  double tremor_rms_n = 0;
};

wire::MoleculeSource helix(const std::string& chain) {
  wire::MoleculeSource source;
  source.set_file(kHelices);
  source.add_chains(chain);
  return source;
}

/// Returns poses on the line between the centres, with the orientations of the files. The molecules approach from
/// kApart_angstrom outside their contact distance to `deeper_angstrom` inside.
std::vector<Pose> approach_of(const server::LoadedScene& scene, double deeper_angstrom) {
  const auto& bodies = scene.world.bodies;
  const Vec3 line = native_pose(scene).p.normalized();
  const double contact =
      server::contact_distance_angstrom(*bodies[0].molecule, *bodies[1].molecule, scene.world.field_model, line);
  std::vector<Pose> poses;
  for (double out = kApart_angstrom; out > -deeper_angstrom; out -= kStep_angstrom)
    poses.push_back({(contact + out) * line, Quat::Identity()});
  return poses;
}

PublishedPair pair_of_helices() {
  PublishedPair pair;
  pair.scene = server::docking_scene(helix("A"), helix("B"), {});
  pair.loaded = scene_with_ligand_at(pair.scene, {Vec3(0, 0, 100), Quat::Identity()});
  pair.scene = with_found_scale(std::move(pair.scene), *pair.loaded);
  std::tie(pair.X_AB_min, pair.minimum_kcal_per_mol) = native_minimum(*pair.loaded);
  return pair;
}

/// Adds the statistics of the displayed force.
ShownDocking with_figures(ShownDocking shown) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vec3& force : shown.force_n) along.push_back(force[axis]);
    sum += std::pow(rms(high_passed(along, kRate_hz, kVibration_hz)), 2);
  }
  shown.vibration_rms_n = std::sqrt(sum);
  for (std::size_t k = 0; k < shown.force_n.size(); ++k) {
    shown.peak_n = std::max(shown.peak_n, shown.force_n[k].norm());
    if (k > 0) shown.step_n_per_ms = std::max(shown.step_n_per_ms, (shown.force_n[k] - shown.force_n[k - 1]).norm());
  }
  return shown;
}

ShownDocking with_stable_method(const PublishedPair& pair, const Condition& condition) {
  const std::vector<Pose> approach = approach_of(*pair.loaded, condition.deeper_angstrom);
  const auto scene = scene_with_ligand_at(pair.scene, approach.front());
  const devices::HandPath hand = ligand_hand(*scene, approach, kPerPose, false);
  Experiment experiment = docking_experiment(hand, false, condition.round_trip, kDockingSettling, 1);
  for (ExperimentUser& user : experiment.users) {
    user.device = devices::find_device_profile(condition.device);
    user.hand_parameters.tremor_rms_n = condition.tremor_rms_n;
  }
  const SessionTrace trace = run_virtual_session(experiment, scene);
  ShownDocking shown;
  for (const TickSample& tick : trace.users[1].ticks) {
    shown.at_s.push_back(to_seconds(tick.time));
    shown.force_n.push_back(tick.displayed_D.f);
  }
  return with_figures(std::move(shown));
}

/// A molecule that is fixed to the handle of a simulated device.
struct HeldMolecule {
  devices::SimDevice device;
  Pose X_WM_start;

  HeldMolecule(const devices::DeviceProfile& profile, const devices::HandParameters& hand,
               const devices::HandPath& path, const Pose& X_WM, std::uint64_t seed)
      : device(profile.spec, devices::holding(hand, profile), path, seed), X_WM_start(X_WM) {}

  /// Returns the pose of the molecule [m]. The device's frame is at the start position of the molecule and has the axes
  /// of the world.
  Pose pose_at(LocalTime now) {
    const Pose X_DH = device.read(now).X_DH;
    return {X_WM_start.p + X_DH.p, (X_DH.q * X_WM_start.q).normalized()};
  }
  Vec3 show(LocalTime now, const Wrench& wrench) {
    const devices::DeviceSpec& spec = device.spec();
    const Vec3 force = clamped_to_length(wrench.f, spec.force_limit_n);
    device.write(now, {force, clamped_to_length(wrench.t, spec.torque_limit_n_m)});
    return force;
  }
};

/// Simulates direct rendering: each molecule is fixed to its hand.
/// * Force: the field's wrench at the poses of the hands, with the force scale of the stable method. It is not reduced
///   near the minimum or at high energy.
/// * Transmission: the wrench is delayed by the round trip and held for 1 ms (zero-order hold).
/// * Device: the limits of the device clip the wrench.
///
/// There is no simulated body and no coupling.
ShownDocking with_direct_rendering(const PublishedPair& pair, const Condition& condition) {
  const std::vector<Pose> approach = approach_of(*pair.loaded, condition.deeper_angstrom);
  const auto scene = scene_with_ligand_at(pair.scene, approach.front());
  const physics::WorldDescription& world = scene->world;
  docking::MolecularField field(*world.bodies[0].molecule, *world.bodies[1].molecule, world.field_model);
  const devices::HandPath path = ligand_hand(*scene, approach, kPerPose, false);
  const devices::DeviceProfile profile = devices::find_device_profile(condition.device);
  devices::HandParameters hand;
  hand.tremor_rms_n = condition.tremor_rms_n;
  HeldMolecule receptor(profile, hand, receptor_hand(path, false), world.bodies[0].X_WB, 1);
  HeldMolecule ligand(profile, hand, path, world.bodies[1].X_WB, 2);
  const double metres = world.metres_per_angstrom;
  const double newtons = world.newtons_per_kcal_per_mol_angstrom / docking::kKilojoulesPerKilocalorie;
  std::deque<std::array<Wrench, 2>> on_the_way(static_cast<std::size_t>(condition.round_trip / kHapticPeriod));
  ShownDocking shown;
  for (Duration at{0}; at < settles_at(path) + kDockingSettling; at += kHapticPeriod) {
    const LocalTime now(at);
    const Pose X_WA = receptor.pose_at(now), X_WB = ligand.pose_at(now);
    Pose X_AB = X_WA.inverse() * X_WB;
    const Vec3 p_AB_m = X_AB.p;
    X_AB.p /= metres;
    const docking::FieldResult here = field.evaluate(X_AB);
    const Vec3 f = newtons * here.force_on_b, t = newtons * metres * here.torque_on_b;
    on_the_way.push_back({Wrench{X_WA.q * -f, X_WA.q * (-t - p_AB_m.cross(f))}, Wrench{X_WA.q * f, X_WA.q * t}});
    receptor.show(now, on_the_way.front()[0]);
    shown.at_s.push_back(to_seconds(at));
    shown.force_n.push_back(ligand.show(now, on_the_way.front()[1]));
    on_the_way.pop_front();
  }
  return with_figures(std::move(shown));
}

/// Returns how far a pair drifts from the minimum when both hands relax there and have tremor: the largest energy above
/// the minimum, E − E_min [kT], from the time kAloneFrom_s on.
double left_alone_kt(const PublishedPair& pair, std::uint64_t seed, Duration round_trip) {
  const auto scene = scene_with_ligand_at(pair.scene, pair.X_AB_min);
  devices::WayPoint start, settle;
  start.is_relaxed = settle.is_relaxed = true;
  settle.at = kHapticPeriod;
  Experiment experiment = docking_experiment(devices::HandPath({start, settle}), true, round_trip, kAlone, seed);
  for (ExperimentUser& user : experiment.users) user.hand_parameters.tremor_rms_n = kTremor_n;
  const SessionTrace trace = run_virtual_session(experiment, scene);
  double greatest = 0;
  for (const BodiesSample& sample : trace.bodies) {
    if (to_seconds(sample.time) < kAloneFrom_s) continue;
    const double energy = sample.field_energy_kj_per_mol / docking::kKilojoulesPerKilocalorie;
    greatest = std::max(greatest, (energy - pair.minimum_kcal_per_mol) / kThermalEnergy_kcal_per_mol);
  }
  return greatest;
}

struct Comparison {
  Condition condition;
  ShownDocking direct, stable;

  double times_less() const { return direct.vibration_rms_n / stable.vibration_rms_n; }
};

Comparison compared(const PublishedPair& pair, Condition condition) {
  Comparison made{std::move(condition), {}, {}};
  made.direct = with_direct_rendering(pair, made.condition);
  made.stable = with_stable_method(pair, made.condition);
  return made;
}

Plot force_figure(const Comparison& trial) {
  Plot figure;
  figure.caption = "Force on the ligand's hand, " + trial.condition.name + ": approach, contact, pressed and held.";
  figure.description = figure.caption;
  figure.x = {.quantity = "time", .unit = "s"};
  figure.y = {.quantity = "force", .unit = "N"};
  for (const bool is_direct : {true, false}) {
    const ShownDocking& shown = is_direct ? trial.direct : trial.stable;
    Series series{is_direct ? "shown directly" : "stable method", shown.at_s, {}, is_direct ? 1 : 0};
    for (const Vec3& force : shown.force_n) series.y.push_back(force.norm());
    figure.series.push_back(std::move(series));
  }
  return figure;
}

boost::json::object json_of(const ShownDocking& shown) {
  return {{"vibration_rms_n", shown.vibration_rms_n}, {"peak_n", shown.peak_n}, {"step_n_per_ms", shown.step_n_per_ms}};
}

}  // namespace

std::filesystem::path docking_file() {
  const std::filesystem::path parameters = server::kOplsDirectory;
  return std::filesystem::exists(kHelices) ? parameters / "forcefield.itp" : std::filesystem::path(kHelices);
}

Reproduction reproduce_docking(const Clock&) {
  const PublishedPair pair = pair_of_helices();
  const std::string exact = "sim", phantom = "phantom-premium-1.5-6dof";
  const Duration late = from_seconds(0.1);
  std::vector<Comparison> trials;
  for (Condition& condition :
       std::vector<Condition>{{"no delay", "kicks and vibration", "smooth", phantom, Duration(0)},
                              {"no delay, pushed hard", "", "", phantom, Duration(0), kPushed_angstrom},
                              {"100 ms", "", "", phantom, late},
                              {"no delay, hands tremble", "", "", phantom, Duration(0), kPressed_angstrom, kTremor_n},
                              {"no delay, exact positions", "", "", exact, Duration(0)}}) {
    trials.push_back(compared(pair, std::move(condition)));
  }
  const double zero_kt = pair.scene.molecular_field().zero_area_kt();
  double alone_kt = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) alone_kt = std::max(alone_kt, left_alone_kt(pair, seed, late));

  Reproduction result;
  result.title = "Docking of two helices with the stable method and without";
  result.summary =
      "The thesis docks a helix of 154 atoms and a peptide of 266; neither is published, so these are the helices "
      "of PDB 3AL1. A hand of 0.3 kg and 200 N/m brings one to the other's, which rests in a hand like it, at 60 "
      "mm/s (10 mm/Å) from 8 Å outside to 3 Å deeper than contact (pushed hard: 8 Å), and holds it there, both on the "
      "thesis' Phantom Premium with its steps of 0.03 mm. Directly: force and torque of the field where the two hands "
      "are, held for 1 ms, a round trip later, cut off at the device's limits. Stable method: bodies, coupling, zero "
      "area and knee as a room of tandem-server has them. Same scale: the strongest pull is 1 N. What is not claimed: "
      "without delay a light contact is soft enough to be shown directly; a hand's tremor of 0.05 N then keeps it from "
      "vibrating by itself, and where positions are exact and 1 kHz is kept, as no device and network do, it is as "
      "smooth. Left alone: both hands relaxed at the least energy, 0.05 N of tremor in each, 100 ms of round trip, "
      "five "
      "seeds.";
  const auto add = [&](const std::string& what, const std::string& published, double value, int decimals,
                       const std::string& unit) {
    result.rows.push_back({what, published, format_fixed(value, decimals) + " " + unit});
  };
  for (const auto& [condition, direct, stable] : trials) {
    const std::string& name = condition.name;
    add(name + ": above 30 Hz, rms, directly", condition.published_direct, direct.vibration_rms_n, 4, "N");
    add(name + ": above 30 Hz, rms, stable", condition.published_stable, stable.vibration_rms_n, 4, "N");
    add(name + ": greatest step, directly", "", direct.step_n_per_ms, 3, "N/ms");
    add(name + ": greatest step, stable", "", stable.step_n_per_ms, 3, "N/ms");
    add(name + ": greatest force, directly", "", direct.peak_n, 2, "N");
    add(name + ": greatest force, stable", "", stable.peak_n, 2, "N");
  }
  add("left alone from 3 s to 6 s, E − E_min at most", "", alone_kt, 2, "kT");
  const std::string less = "force above 30 Hz (rms), directly over stable";
  for (std::size_t i = 0; i < kClaimed; ++i) {
    const double at_least = i == 0 ? kTimesLessLightly : kTimesLess;
    result.claims.push_back(
        {"contact, " + trials[i].condition.name, less, trials[i].times_less(), Relation::kAtLeast, at_least, "", 1});
  }
  result.claims.push_back(
      {"left alone", "E − E_min within the zero area and its edge", alone_kt, Relation::kAtMost, zero_kt + 1, "kT", 2});
  for (const Comparison& trial : trials) result.figures.push_back(force_figure(trial));
  const wire::MolecularField& field = pair.scene.molecular_field();
  boost::json::object details{{"newtons_per_kcal_per_mol_angstrom", field.newtons_per_kcal_per_mol_angstrom()},
                              {"zero_area_kt", zero_kt},
                              {"minimum_kcal_per_mol", pair.minimum_kcal_per_mol},
                              {"alone_kt", alone_kt}};
  for (const auto& [condition, direct, stable] : trials) {
    details[condition.name] = boost::json::object{{"device", condition.device},
                                                  {"round_trip_ms", to_seconds(condition.round_trip) * 1e3},
                                                  {"deeper_than_contact_angstrom", condition.deeper_angstrom},
                                                  {"tremor_rms_n", condition.tremor_rms_n},
                                                  {"directly", json_of(direct)},
                                                  {"stable", json_of(stable)}};
  }
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
