// Parts of docking trials: energy minima of the two molecules of a docking scene, and a hand that moves the ligand
// through given poses.
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

/// Returns a molecule with the atoms for which `is_in_part(atom)` is true. The properties that the molecular field uses
/// are copied, but names of atoms and residues are not.
docking::Molecule part_of(const docking::Molecule& molecule, const std::function<bool(std::size_t)>& is_in_part);

/// Returns the pose of the ligand (body 1) in the receptor's frame (body 0) as given by the structure files. Both
/// frames have their origin at the centre of the molecule [Å].
Pose native_pose(const server::LoadedScene& scene);
/// Returns the minimum that is reached by minimising the energy from the native pose: its pose, and its energy in the
/// scene's field [kcal/mol].
/// Cost    a few hundred evaluations of exact_field(). If the field has a cut-off, they include only atoms of one
///         molecule within the cut-off plus 4 Å of the other molecule
std::pair<Pose, double> native_minimum(const server::LoadedScene& scene);
/// Returns the minima that energy minimisation reaches from random poses around the native pose, with their energies
/// [kcal/mol]. The start poses have a Lennard-Jones energy of at most 50 kcal/mol.
///
/// In      rmsd_angstrom  RMSD of each start pose from the native pose
/// Out     at most `count` minima; fewer if too few random poses are free of overlap
/// Cost    that of native_minimum() for each minimum
std::vector<std::pair<Pose, double>> minima_around_native(const server::LoadedScene& scene, std::size_t count,
                                                          double rmsd_angstrom, std::uint64_t seed);
/// Returns the pose interpolated between `from` (share = 0) and `to` (share = 1).
Pose pose_between(const Pose& from, const Pose& to, double share);
/// Returns the pose of the ligand in the receptor's frame [Å], taken from a sample of a trace's bodies.
Pose ligand_pose(const server::LoadedScene& scene, const BodiesSample& sample);

/// Loads a docking scene (see docking_scene()) with the ligand and its tool at the pose `X_AB_angstrom`.
/// Fails   see server::load_scene_text()
std::shared_ptr<const server::LoadedScene> scene_with_ligand_at(wire::Scene scene, const Pose& X_AB_angstrom);

/// Returns `scene` with the values that were computed when `loaded` was loaded. Later loads of the result skip the
/// computation. The values are:
/// * force scale;
/// * knee: energy above which the force is limited;
/// * zero area: range of energies near the minimum in which no force is displayed.
wire::Scene with_found_scale(wire::Scene scene, const server::LoadedScene& loaded);

/// Returns the path of the ligand's hand. It has these phases:
/// * "approach": the hand rests for 0.3 s, then it moves along `poses`. Each pose takes `per_pose`; the hand is slower
///   near both ends of the path.
/// * "hold": the hand holds the last pose for 0.5 s.
/// * "settle": the hand relaxes if `relaxes` is true; otherwise it continues to hold the last pose.
/// In      poses  X_AB [Å], at least two; the first is the pose at which scene_with_ligand_at() placed the ligand
devices::HandPath ligand_hand(const server::LoadedScene& scene, std::span<const Pose> poses, Duration per_pose,
                              bool relaxes);
/// Returns the path of the receptor's hand, which rests. If `relaxes` is true, it relaxes at the same time as the
/// ligand's hand.
devices::HandPath receptor_hand(const devices::HandPath& ligand, bool relaxes);
/// Returns the time at which a hand of ligand_hand() begins the phase "settle".
Duration settles_at(const devices::HandPath& hand);

/// Returns an experiment with two users, one for each molecule, over a link with the delay `round_trip`. It ends when
/// the phase "settle" has lasted for `settling`.
Experiment docking_experiment(const devices::HandPath& ligand, bool relaxes, Duration round_trip, Duration settling,
                              std::uint64_t seed);

/// Returns the largest change of the computed force (before the slew limit) between two ticks, over all users [N/ms].
double force_step_n_per_ms(const SessionTrace& trace);
double peak_force_n(const SessionTrace& trace);

}  // namespace tandem::lab
