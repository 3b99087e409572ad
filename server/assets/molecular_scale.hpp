// Finds the scale of the interaction between molecules, where the author of a scene leaves it open, by probing them.
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

/// Distance of `b` from the origin of `a` along `direction_A` at contact [Å]. Beyond it no position has a Lennard-Jones
/// energy above 5 kcal/mol.
/// In      a, b  positions relative to their own centres; orientation of b that of a
double contact_distance_angstrom(const docking::Molecule& a, const docking::Molecule& b,
                                 const docking::FieldModel& model, const Vec3& direction_A);

/// Pose of least energy near `X_AB_angstrom` after all steps of a PoseMinimiser, and its energy [kcal/mol].
std::pair<Pose, double> minimum_near(const docking::Molecule& a, const docking::Molecule& b,
                                     const docking::FieldModel& model, const Pose& X_AB_angstrom);

/// Progress callback for molecules of more than a million pairs: the current task, and the share that is done (0..1).
using ScaleProgress = std::function<void(const std::string& what, double done)>;

/// Fills in the numbers of `field` that are 0, which means "to be found": newtons_per_kcal_per_mol_angstrom,
/// knee_kcal_per_mol and, with a zero area, minimum_kcal_per_mol. Probes each pair of molecules in two ways. First they
/// approach each other along their centres, in the orientation of their files, and from six sides. Then they are drawn
/// out of their pose in the files along the easiest of 24 directions, with sideways motion free. The strongest pull of
/// all probes becomes 1 N. The minimum is the least energy of descents from the best approach and from the pose in the
/// files. A zero area that would contain all attraction is removed.
///
/// In      molecules      positions relative to their own centres
///         centres        centre of each molecule in its file [Å]
/// Out     results, one line of text for the user each
/// Fails   std::invalid_argument: a minimum is to be found for more than a million pairs of atoms
std::vector<std::string> complete_molecular_scale(wire::MolecularField& field,
                                                  std::span<const docking::Molecule* const> molecules,
                                                  std::span<const Vec3> centres_angstrom,
                                                  const docking::FieldModel& model, const ScaleProgress& progress = {});

}  // namespace tandem::server
