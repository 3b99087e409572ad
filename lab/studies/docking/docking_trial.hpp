// Parts of docking trials: the minima of a docking scene's two molecules, and a hand that moves the ligand through
// given poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "devices/sim/hand_path.hpp"
#include "lab/session/trace.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::lab {

/// The atoms for which `is_in_part(atom)` holds, with all properties that the field uses; without names.
docking::Molecule part_of(const docking::Molecule& molecule, const std::function<bool(std::size_t)>& is_in_part);

/// Pose of the ligand's molecule (body 1) in the receptor's (body 0) as the files have it, both about their centres
/// [Å].
Pose native_pose(const server::LoadedScene& scene);
/// The minimum downhill from the native pose, and its energy [kcal/mol], by the scene's field.
/// Cost    a few hundred evaluations of exact_field(); with a cut-off, restricted to the atoms within the cut-off plus
///         4 Å
std::pair<Pose, double> native_minimum(const server::LoadedScene& scene);
/// Minima downhill from random poses around the native one, and their energies [kcal/mol], as native_minimum(). Start
/// poses have at most 50 kcal/mol of Lennard-Jones energy.
///
/// In      rmsd_angstrom  RMSD of each start to the native pose
/// Out     at most `count`; fewer where too few poses are free of overlap
/// Cost    native_minimum() each
std::vector<std::pair<Pose, double>> minima_around_native(const server::LoadedScene& scene, std::size_t count,
                                                          double rmsd_angstrom, std::uint64_t seed);
/// The pose at `share` of the way from `from` to `to`, 0 to 1.
Pose pose_between(const Pose& from, const Pose& to, double share);
/// Pose of the ligand in the receptor's frame [Å], from a sample of a trace's bodies.
Pose ligand_pose(const server::LoadedScene& scene, const BodiesSample& sample);

/// Loads the scene of docking_scene() or a similar one, with the ligand and its tool placed at `X_AB` [Å].
/// Fails   see server::load_scene_text()
std::shared_ptr<const server::LoadedScene> scene_with_ligand_at(wire::Scene scene, const Pose& X_AB_angstrom);

/// `scene` with the force scale, the knee and the zero area found by loading; later loads skip their computation.
wire::Scene with_found_scale(wire::Scene scene, const server::LoadedScene& loaded);

/// The ligand's hand. It rests for 0.3 s (phase "approach") and moves along `poses` at one pose each `per_pose`,
/// slower at both ends. It then holds for 0.5 s (phase "hold") and either relaxes or keeps guiding ("settle").
/// In      poses  X_AB [Å], at least two, the first as placed by scene_with_ligand_at()
devices::HandPath ligand_hand(const server::LoadedScene& scene, std::span<const Pose> poses, Duration per_pose,
                              bool relaxes);
/// The receptor's hand: it rests, and relaxes when the ligand's hand does.
devices::HandPath receptor_hand(const devices::HandPath& ligand, bool relaxes);
/// Time at which a hand of ligand_hand() begins to settle.
Duration settles_at(const devices::HandPath& hand);

/// An experiment of two users, each with one hand, over `round_trip`. It ends `settling` after the hands begin to
/// settle.
Experiment docking_experiment(const devices::HandPath& ligand, bool relaxes, Duration round_trip, Duration settling,
                              std::uint64_t seed);

/// Largest change of the computed force (before the slew limit) between two ticks, over all users [N/ms].
double force_step_n_per_ms(const SessionTrace& trace);
double peak_force_n(const SessionTrace& trace);

}  // namespace tandem::lab
