// Finds a path along which a ligand leaves a complex of two rigid molecules.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Upper limit of the Lennard-Jones energy of a pose on the exit path.
inline constexpr double kExitBound_kcal_per_mol = 50;
/// Conditions under which B has left A: B has moved at least kExitDistance_angstrom, and the attraction is at most
/// kHardlyHeld_kcal_per_mol.
inline constexpr double kExitDistance_angstrom = 8;
inline constexpr double kHardlyHeld_kcal_per_mol = 5;
/// Length of a step: displacement of B's origin by a translation, or of B's farthest atom by a rotation. The
/// minimisation after a step may add up to 0.4 Å.
inline constexpr double kExitStep_angstrom = 0.25;
/// Maximum number of evaluated poses in the search with one energy bound.
inline constexpr std::size_t kExitEffort = 60'000;

/// Returns the distance between the first and the last pose [Å].
double way_out_angstrom(std::span<const Pose> way);

/// Returns a randomised path along which molecule B leaves A through poses of bounded energy. The motion between two
/// poses is checked at each quarter. Of the energy bounds 10, 20, … 50 kcal/mol, the lowest that lets B leave is used.
/// Therefore the hands apply no more force than necessary.
///
/// Model   A tree of poses is grown from the start pose. Each iteration has three steps:
///         1. It selects the pose that is farthest in a random direction. For this ranking, 0.05 Å are subtracted for
///            each earlier attempt at a pose.
///         2. It adds a new pose. The step to it combines the random direction, the direction and rotation of the step
///            that led to the selected pose, and noise.
///         3. It minimises the energy of the new pose by rotation and by motion perpendicular to the step, at most 0.4
///            Å
/// Source  our method, based on the expansive trees of motion planning
/// In      X_AB    start pose [Å]
///         effort  number of poses that are evaluated for each bound
/// Out     poses of B in A, from X_AB until B has left. If B cannot leave at any bound: the path to the farthest pose
///         found. If this path ends closer than kExitDistance_angstrom, B counts as locked in
/// Cost    one evaluation of a MolecularField for each pose
std::vector<Pose> exit_path(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                            const Pose& X_AB_angstrom, std::uint64_t seed, std::size_t effort = kExitEffort);

}  // namespace tandem::lab
