// Finds numbers that a scene with molecules leaves open, such as the scale of forces, by moving the molecules and
// evaluating their energy (probing).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// Returns the distance of `b` from the origin of `a` along `direction_A` at contact [Å]. Contact is where the
/// Lennard-Jones energy first exceeds 5 kcal/mol when `b` approaches.
/// In      a, b  positions relative to their own centres; b has the orientation of a
double contact_distance_angstrom(const docking::Molecule& a, const docking::Molecule& b,
                                 const docking::FieldModel& model, const Vec3& direction_A);

/// Returns the pose of lowest energy near `X_AB_angstrom` and its energy [kcal/mol], found by running a PoseMinimiser
/// to its end.
std::pair<Pose, double> minimum_near(const docking::Molecule& a, const docking::Molecule& b,
                                     const docking::FieldModel& model, const Pose& X_AB_angstrom);

/// Progress callback, called only for molecules with more than a million pairs of atoms. Its arguments are a
/// description of the current task and its completed fraction (0..1).
using ScaleProgress = std::function<void(const std::string& what, double done)>;

/// Fills in those numbers of `field` that are 0, which means "to be found":
/// * newtons_per_kcal_per_mol_angstrom: such that the strongest attraction of all probes becomes 1 N;
/// * knee_kcal_per_mol: the energy above which the displayed force is limited;
/// * minimum_kcal_per_mol, if the field has a zero area (energies near the minimum without displayed force): the lowest
///   energy of two descents, from the best approach and from the pose in the files.
///
/// Each pair of molecules is probed in two ways:
/// 1. The molecules approach each other in the orientation of their files: along their line of centres, and from six
///    sides.
/// 2. One molecule is pulled out of its pose in the files in 24 directions, with free sideways motion. The direction
///    with the least resistance counts.
/// If the zero area would contain all attraction, it is removed.
///
/// In      molecules      positions relative to their own centres
///         centres        centre of each molecule in its file [Å]
/// Out     one line of text per result, for the user
/// Fails   std::invalid_argument: a minimum is to be found for more than a million pairs of atoms
std::vector<std::string> complete_molecular_scale(wire::MolecularField& field,
                                                  std::span<const docking::Molecule* const> molecules,
                                                  std::span<const Vec3> centres_angstrom,
                                                  const docking::FieldModel& model, const ScaleProgress& progress = {});

}  // namespace tandem::server
