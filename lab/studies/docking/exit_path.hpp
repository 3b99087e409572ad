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
/// B has left A if both conditions hold: it has moved at least kExitDistance_angstrom, and the energy of attraction is
/// at most kHardlyHeld_kcal_per_mol.
inline constexpr double kExitDistance_angstrom = 8;
inline constexpr double kHardlyHeld_kcal_per_mol = 5;
/// Length of a step of the search. It is the displacement of B's origin by the step's translation, and the displacement
/// of B's farthest atom by its rotation. The minimisation after the step may move B by a further 0.4 Å.
inline constexpr double kExitStep_angstrom = 0.25;
/// Maximum number of evaluated poses in the search with one energy bound.
inline constexpr std::size_t kExitEffort = 60'000;

/// Returns the distance between the first and the last pose [Å].
double way_out_angstrom(std::span<const Pose> way);

/// Returns a randomised path along which molecule B leaves A. The energy on the path does not exceed a bound. It is
/// also checked between two poses, at each quarter of the motion. The bound is the lowest of 10, 20, … 50 kcal/mol with
/// which B can leave. With a low bound, the hands need little force.
///
/// Model   A tree of poses is grown from the start pose. Each iteration has three steps:
///         1. It selects the pose of the tree that is farthest in a random direction. To spread the attempts, the
///            distance of a pose counts 0.05 Å less for each earlier selection of this pose.
///         2. It adds a new pose. The step to it combines the random direction, the direction and rotation of the step
///            that led to the selected pose, and noise.
///         3. It minimises the energy of the new pose by rotation and by motion perpendicular to the step, at most 0.4
///            Å
/// Source  our method, based on the expansive trees of motion planning
/// In      X_AB    start pose [Å]
///         effort  number of poses that are evaluated for each bound
/// Out     poses of B in A, from X_AB until B has left. If B cannot leave with any bound, the result is the path to the
///         farthest pose found. B counts as locked in if this path ends closer than kExitDistance_angstrom (see
///         way_out_angstrom())
/// Cost    one evaluation of a MolecularField for each pose
std::vector<Pose> exit_path(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                            const Pose& X_AB_angstrom, std::uint64_t seed, std::size_t effort = kExitEffort);

}  // namespace tandem::lab
