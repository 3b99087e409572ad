#include "lab/studies/docking/docking_trial.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "common/base/random.hpp"
#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/metrics/capri.hpp"
#include "proto/placement.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/molecular_scale.hpp"

namespace tandem::lab {
namespace {

constexpr std::size_t kReceptor = 0, kLigand = 1;
constexpr Duration kRest{from_seconds(0.3)}, kHold{from_seconds(0.5)}, kPoint{kHapticPeriod};
/// Duration of each of two ramps: the hand's speed rises at the start of the path and falls at its end.
constexpr double kRamp_s = 0.3;
constexpr std::string_view kSettle = "settle";
constexpr int kHalvings = 30;
/// Maximum number of random poses that are tried for one start of a minimisation. A start must be free of overlap.
constexpr std::size_t kTriesForAStart = 200;
constexpr double kFreeStart_kj_per_mol = 50 * docking::kKilojoulesPerKilocalorie;

const docking::Molecule& molecule(const server::LoadedScene& scene, std::size_t body) {
  return *scene.world.bodies[body].molecule;
}

/// Returns the atoms of `molecule` that are within `reach` of an atom of `other`, whose pose is X_MO.
docking::Molecule near_part(const docking::Molecule& molecule, const docking::Molecule& other, const Pose& X_MO,
                            double reach) {
  return part_of(molecule, [&](std::size_t i) {
    return std::ranges::any_of(other.positions_angstrom, [&](const Vec3& there) {
      return (X_MO * there - molecule.positions_angstrom[i]).squaredNorm() < reach * reach;
    });
  });
}

/// Energy minimisations for the ligand of one scene. If the field has a cut-off, only atoms near the other molecule are
/// evaluated.
class Descents {
 public:
  explicit Descents(const server::LoadedScene& scene)
      : a_(molecule(scene, kReceptor)), b_(molecule(scene, kLigand)), model_(scene.world.field_model) {
    if (model_.cutoff_angstrom == 0) return;
    const Pose native = native_pose(scene);
    const double reach = model_.cutoff_angstrom + kMore_angstrom;
    near_.emplace(near_part(a_, b_, native, reach), near_part(b_, a_, native.inverse(), reach));
  }

  /// Returns the minimum reached from `start`, and its energy over all atoms [kcal/mol].
  std::pair<Pose, double> from(const Pose& start) const {
    if (!near_) return server::minimum_near(a_, b_, model_, start);
    const Pose minimum = server::minimum_near(near_->first, near_->second, model_, start).first;
    return {minimum,
            docking::exact_field(a_, b_, minimum, model_).energy_kj_per_mol() / docking::kKilojoulesPerKilocalorie};
  }

 private:
  static constexpr double kMore_angstrom = 4;  ///< margin of the selected atoms: largest expected motion of the ligand

  const docking::Molecule& a_;
  const docking::Molecule& b_;
  const docking::FieldModel& model_;
  std::optional<std::pair<docking::Molecule, docking::Molecule>> near_;
};

Vec3 random_vector(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

/// Returns `X_AB` after a random translation and rotation that give the ligand an RMSD of `rmsd_angstrom` from X_AB.
Pose displaced(const Pose& X_AB, const docking::Molecule& ligand, double rmsd_angstrom, Random& random) {
  const Vec3 move = random_vector(random), turn = random_vector(random) / ligand.gyration_radius_angstrom();
  const auto moved_by = [&](double share) {
    return Pose{X_AB.p + share * move, (quaternion_of(share * turn) * X_AB.q).normalized()};
  };
  double less = 0, more = 1;
  while (ligand_rmsd_angstrom(ligand, X_AB, moved_by(more)) < rmsd_angstrom) more *= 2;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (less + more);
    (ligand_rmsd_angstrom(ligand, X_AB, moved_by(middle)) < rmsd_angstrom ? less : more) = middle;
  }
  return moved_by(more);
}

/// Returns the hand's position on a path of `count` poses at `time_s`: the number of poses passed. A position between
/// two poses is a fraction.
double done(double time_s, double per_pose_s, double count) {
  const double whole_s = count * per_pose_s + kRamp_s;
  const auto ramp = [&](double t_s) { return t_s * t_s / (2 * kRamp_s * per_pose_s); };
  if (time_s <= 0) return 0;
  if (time_s >= whole_s) return count;
  if (time_s < kRamp_s) return ramp(time_s);
  if (time_s > whole_s - kRamp_s) return count - ramp(whole_s - time_s);
  return (time_s - kRamp_s / 2) / per_pose_s;
}

Pose between(std::span<const Pose> poses, double index) {
  const auto i = std::min(static_cast<std::size_t>(index), poses.size() - 2);
  return pose_between(poses[i], poses[i + 1], index - static_cast<double>(i));
}

Pose in_metres(Pose X, double metres_per_angstrom) {
  X.p *= metres_per_angstrom;
  return X;
}

ExperimentUser user(const std::string& name, const devices::HandPath& hand, Duration delay, Duration tick_phase) {
  ExperimentUser made;
  made.name = name;
  made.hand_name = name;
  made.hand = hand;
  made.up.delay = made.down.delay = delay;
  made.tick_phase = tick_phase;
  return made;
}

template <class Quantity>
double greatest(const SessionTrace& trace, Quantity of) {
  double found = 0;
  for (const UserTrace& user : trace.users) {
    for (std::size_t k = 1; k < user.ticks.size(); ++k) found = std::max(found, of(user.ticks[k - 1], user.ticks[k]));
  }
  return found;
}

}  // namespace

docking::Molecule part_of(const docking::Molecule& molecule, const std::function<bool(std::size_t)>& is_in_part) {
  docking::Molecule part;
  part.mixes_arithmetically = molecule.mixes_arithmetically;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (!is_in_part(i)) continue;
    part.positions_angstrom.push_back(molecule.positions_angstrom[i]);
    part.sigma_angstrom.push_back(molecule.sigma_angstrom[i]);
    part.epsilon_kj_per_mol.push_back(molecule.epsilon_kj_per_mol[i]);
    part.charge_e.push_back(molecule.charge_e[i]);
    part.mass_u.push_back(molecule.mass_u[i]);
  }
  return part;
}

Pose native_pose(const server::LoadedScene& scene) {
  return {scene.molecule_centres_angstrom[kLigand] - scene.molecule_centres_angstrom[kReceptor], Quat::Identity()};
}

std::pair<Pose, double> native_minimum(const server::LoadedScene& scene) {
  return Descents(scene).from(native_pose(scene));
}

std::vector<std::pair<Pose, double>> minima_around_native(const server::LoadedScene& scene, std::size_t count,
                                                          double rmsd_angstrom, std::uint64_t seed) {
  const Descents descents(scene);
  const docking::Molecule &a = molecule(scene, kReceptor), &b = molecule(scene, kLigand);
  docking::FieldModel walls = scene.world.field_model;
  walls.dielectric = docking::Dielectric::kNone;
  walls.has_far_grid = false;
  docking::MolecularField field(a, b, walls);
  Random random(seed, 2);
  std::vector<std::pair<Pose, double>> minima;
  for (std::size_t tried = 0; tried < kTriesForAStart * count && minima.size() < count; ++tried) {
    const Pose start = displaced(native_pose(scene), b, rmsd_angstrom, random);
    if (field.evaluate(start).lennard_jones_kj_per_mol > kFreeStart_kj_per_mol) continue;
    minima.push_back(descents.from(start));
  }
  return minima;
}

Pose pose_between(const Pose& from, const Pose& to, double share) {
  const Vec3 turn = rotation_vector(to.q * from.q.conjugate());
  return {from.p + share * (to.p - from.p), (quaternion_of(share * turn) * from.q).normalized()};
}

Pose ligand_pose(const server::LoadedScene& scene, const BodiesSample& sample) {
  Pose X_AB = sample.X_WB[kReceptor].inverse() * sample.X_WB[kLigand];
  X_AB.p /= scene.world.metres_per_angstrom;
  return X_AB;
}

std::shared_ptr<const server::LoadedScene> scene_with_ligand_at(wire::Scene scene, const Pose& X_AB_angstrom) {
  const wire::Placement& receptor = scene.bodies(kReceptor).placement();
  const Pose X_WA = proto::pose_from_placement(receptor);
  const Pose X_WB = X_WA * in_metres(X_AB_angstrom, scene.molecular_field().metres_per_angstrom());
  const Vec3 zyx_deg = X_WB.q.toRotationMatrix().eulerAngles(2, 1, 0) * 180 / std::numbers::pi;
  wire::Placement& body = *scene.mutable_bodies(kLigand)->mutable_placement();
  wire::Placement& tool = *scene.mutable_tools(kLigand)->mutable_placement();
  body.Clear();
  tool.Clear();
  for (const double part : X_WB.p) {
    body.add_position_m(part);
    tool.add_position_m(part);
  }
  for (int axis = 2; axis >= 0; --axis) body.add_rotation_xyz_deg(zyx_deg[axis]);
  return server::load_scene_text(server::scene_text(scene), "docking trial", "/");
}

wire::Scene with_found_scale(wire::Scene scene, const server::LoadedScene& loaded) {
  const wire::MolecularField& found = loaded.description.molecular_field();
  wire::MolecularField& field = *scene.mutable_molecular_field();
  field.set_newtons_per_kcal_per_mol_angstrom(found.newtons_per_kcal_per_mol_angstrom());
  field.set_knee_kcal_per_mol(found.knee_kcal_per_mol());
  field.set_zero_area_kt(found.zero_area_kt());
  field.set_minimum_kcal_per_mol(found.minimum_kcal_per_mol());
  return scene;
}

devices::HandPath ligand_hand(const server::LoadedScene& scene, std::span<const Pose> poses, Duration per_pose,
                              bool relaxes) {
  const Pose X_WA = scene.world.bodies[kReceptor].X_WB;
  const WorkspaceMapping& workspace = scene.workspaces[kLigand];
  const auto world = [&](const Pose& X_AB) { return X_WA * in_metres(X_AB, scene.world.metres_per_angstrom); };
  const Pose start = world(poses.front());
  const auto point = [&](Duration at, const Pose& X_AB, std::string phase, bool is_relaxed) {
    const Pose X_WB = world(X_AB);
    const Quat q_DW = workspace.X_WD.q.conjugate();
    const Quat turn_W = X_WB.q * start.q.conjugate();
    devices::WayPoint made;
    made.at = at;
    made.X_DH = {q_DW * (X_WB.p - workspace.X_WD.p) / workspace.position_scale,
                 (q_DW * turn_W * workspace.X_WD.q).normalized()};
    made.phase = std::move(phase);
    made.is_relaxed = is_relaxed;
    return made;
  };
  std::vector<devices::WayPoint> points{point(Duration(0), poses.front(), "approach", false)};
  const double per_pose_s = to_seconds(per_pose), count = static_cast<double>(poses.size() - 1);
  const Duration whole = from_seconds(count * per_pose_s + kRamp_s);
  for (Duration at{0}; at < whole; at += kPoint) {
    points.push_back(point(kRest + at, between(poses, done(to_seconds(at), per_pose_s, count)), "", false));
  }
  points.push_back(point(kRest + whole, poses.back(), "hold", false));
  points.push_back(point(kRest + whole + kHold, poses.back(), std::string(kSettle), relaxes));
  return devices::HandPath(std::move(points));
}

devices::HandPath receptor_hand(const devices::HandPath& ligand, bool relaxes) {
  devices::WayPoint rest, settle;
  settle.at = settles_at(ligand);
  settle.phase = kSettle;
  settle.is_relaxed = relaxes;
  return devices::HandPath({rest, settle});
}

Duration settles_at(const devices::HandPath& hand) {
  return hand.points().back().at;
}

Experiment docking_experiment(const devices::HandPath& ligand, bool relaxes, Duration round_trip, Duration settling,
                              std::uint64_t seed) {
  Experiment made;
  made.name = "docking";
  made.seed = seed;
  made.reference_stage = truth_stage();
  made.duration = settles_at(ligand) + settling;
  made.users = {user("receptor", receptor_hand(ligand, relaxes), round_trip / 2, kSlot),
                user("ligand", ligand, round_trip / 2, 2 * kSlot)};
  return made;
}

double force_step_n_per_ms(const SessionTrace& trace) {
  return greatest(trace, [](const TickSample& before, const TickSample& now) {
    return (now.stage_D.f - before.stage_D.f).norm() / (to_seconds(now.time - before.time) * 1e3);
  });
}

double peak_force_n(const SessionTrace& trace) {
  return greatest(trace, [](const TickSample&, const TickSample& now) { return now.displayed_D.f.norm(); });
}

}  // namespace tandem::lab
