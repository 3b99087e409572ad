// Parts of docking trials: the minima of a docking scene's two molecules, a hand that brings the ligand along poses.
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

/// The atoms for which `is_in_part(atom)` holds, with all that the field takes from them; without names.
docking::Molecule part_of(const docking::Molecule& molecule, const std::function<bool(std::size_t)>& is_in_part);

/// Where the files have the ligand's molecule (body 1) in the receptor's (body 0), both about their centres [Å].
Pose native_pose(const server::LoadedScene& scene);
/// The minimum downhill from the native pose, and its energy [kcal/mol], by the scene's field.
/// Cost    some hundred evaluations of exact_field(); with a cut-off only for the atoms within the cut-off and 4 Å more
std::pair<Pose, double> native_minimum(const server::LoadedScene& scene);
/// Minima downhill from random poses around the native one, and their energies [kcal/mol], as native_minimum(). A start has
/// no more than 50 kcal/mol of Lennard-Jones energy.
///
/// In      rmsd_angstrom  of each start to the native pose
/// Out     at most `count`, fewer where too few poses are free
/// Cost    native_minimum() each
std::vector<std::pair<Pose, double>> minima_around_native(const server::LoadedScene& scene, std::size_t count,
                                                          double rmsd_angstrom, std::uint64_t seed);
/// The pose at `share` of the way from one to the other, 0 to 1.
Pose pose_between(const Pose& from, const Pose& to, double share);
/// Pose of the ligand in the receptor's frame [Å], from a trace's bodies.
Pose ligand_pose(const server::LoadedScene& scene, const BodiesSample& sample);

/// The scene of docking_scene() or one like it, loaded, with ligand and its tool where `X_AB` has them [Å].
/// Fails   as server::load_scene_text()
std::shared_ptr<const server::LoadedScene> scene_with_ligand_at(wire::Scene scene, const Pose& X_AB_angstrom);

/// `scene` with the scale of forces, the knee and the zero area that loading computed: later loads skip that.
wire::Scene with_found_scale(wire::Scene scene, const server::LoadedScene& loaded);

/// The ligand's hand: rests for 0.3 s (phase "approach"), brings it along `poses` at one pose each `per_pose`, slower at both
/// ends, holds for 0.5 s (phase "hold") and then either relaxes or goes on guiding ("settle").
/// In      poses  X_AB [Å], the first as scene_with_ligand_at() has it, at least two
devices::HandPath ligand_hand(const server::LoadedScene& scene, std::span<const Pose> poses, Duration per_pose,
                              bool relaxes);
/// The receptor's hand: it rests, and relaxes when the ligand's hand does.
devices::HandPath receptor_hand(const devices::HandPath& ligand, bool relaxes);
/// Time at which a hand of ligand_hand() begins to settle.
Duration settles_at(const devices::HandPath& hand);

/// An experiment of two users, each with one hand, over `round_trip`; it ends `settling` after the hands begin to settle.
Experiment docking_experiment(const devices::HandPath& ligand, bool relaxes, Duration round_trip, Duration settling,
                              std::uint64_t seed);

/// The greatest change of a tick's computed force (before the slew limit) from one tick to the next, of all users [N/ms].
double force_step_n_per_ms(const SessionTrace& trace);
double peak_force_n(const SessionTrace& trace);

}  // namespace tandem::lab
