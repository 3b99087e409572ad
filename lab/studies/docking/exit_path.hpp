// Exit path of a ligand from a complex of two rigid molecules.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Largest Lennard-Jones energy of a pose on the exit path [kcal/mol].
inline constexpr double kExitBound_kcal_per_mol = 50;
/// B has left when it is this far from its start [Å] with no more than kHardlyHeld_kcal_per_mol of attraction.
inline constexpr double kExitDistance_angstrom = 8;
inline constexpr double kHardlyHeld_kcal_per_mol = 5;
/// Length of a step of B's origin, and of its farthest atom by rotation [Å]. Downhill relaxation may add 0.4 Å.
inline constexpr double kExitStep_angstrom = 0.25;
/// Number of poses evaluated before an energy bound is given up.
inline constexpr std::size_t kExitEffort = 60'000;

/// Distance from the first to the last of the poses [Å].
double way_out_angstrom(std::span<const Pose> way);

/// A path with noise for molecule B out of A, through poses of bounded energy only. The motion between two poses is
/// checked at quarters. The result uses the lowest of the bounds 10, 20, … 50 kcal/mol that lets B out: hands apply no
/// more force than needed.
///
/// Model   a tree of poses. Each iteration extends the pose that is farthest in a random direction, less 0.05 Å for
///         each earlier trial of it. The new step combines that direction, the direction and rotation of the pose's
///         own step, and noise. The result then relaxes downhill, across the step and in rotation, by at most 0.4 Å
/// Source  our method, after the expansive trees of motion planning
/// In      X_AB  [Å]
///         effort  poses evaluated for each bound
/// Out     poses of B in A from X_AB until B has left. If no bound allows that, the path to the farthest pose found:
///         if it ends closer than kExitDistance_angstrom, B is locked as far as the effort can show
/// Cost    a MolecularField evaluation for each pose
std::vector<Pose> exit_path(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                            const Pose& X_AB_angstrom, std::uint64_t seed, std::size_t effort = kExitEffort);

}  // namespace tandem::lab
