// The way out of a complex, for two molecules that are rigid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// What a pose on the way out may have at most, Lennard-Jones [kcal/mol].
inline constexpr double kExitBound_kcal_per_mol = 50;
/// So far from where it began has B left, with no more than kHardlyHeld_kcal_per_mol of attraction [Å].
inline constexpr double kExitDistance_angstrom = 8;
inline constexpr double kHardlyHeld_kcal_per_mol = 5;
/// A step of B's origin, and of its farthest atom by its turn; what gives way downhill may add 0.4 Å [Å].
inline constexpr double kExitStep_angstrom = 0.25;
/// Poses looked at before a bound is given up.
inline constexpr std::size_t kExitEffort = 60'000;

/// From the first to the last of its poses [Å].
double way_out_angstrom(std::span<const Pose> way);

/// A noisy way for molecule B out of A, through poses of bounded energy alone, the motion between them looked at in
/// quarters. Of the bounds 10, 20, … 50 kcal/mol the lowest that lets it out counts: hands are no stronger than they have to
/// be.
///
/// Model   a tree of poses. Each time the one that is farthest in a random direction, less 0.05 Å for each time that it was
///         tried, takes a step that way, on the way and with the turn that it came by, and with noise; then it gives way
///         downhill, across the step and in turn, by at most 0.4 Å
/// Source  ours, after the expansive trees of motion planning
/// In      X_AB  [Å]; `effort` poses are looked at for each bound
/// Out     poses of B in A from X_AB until it has left; where no bound allows that, to the farthest out that was found: closer
///         than kExitDistance_angstrom, it is locked, as far as the effort can tell
/// Cost    a MolecularField evaluation per pose looked at
std::vector<Pose> exit_path(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                            const Pose& X_AB_angstrom, std::uint64_t seed, std::size_t effort = kExitEffort);

}  // namespace tandem::lab
