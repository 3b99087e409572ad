// How large a scene makes what acts between its molecules, where its author leaves that open: found by a probe of them.
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

/// How far `b` is from the origin of `a` along `direction_A` where they touch: from there on outwards no place has a
/// Lennard-Jones energy above 5 kcal/mol [Å].
/// In      a, b  about their centres; b turned as a is
double contact_distance_angstrom(const docking::Molecule& a, const docking::Molecule& b,
                                 const docking::FieldModel& model, const Vec3& direction_A);

/// The pose of least energy near `X_AB_angstrom` by all steps of a PoseMinimiser, and its energy [kcal/mol].
std::pair<Pose, double> minimum_near(const docking::Molecule& a, const docking::Molecule& b,
                                     const docking::FieldModel& model, const Pose& X_AB_angstrom);

/// Called while molecules of more than a million pairs are probed: what, and how much of it is done (0..1).
using ScaleProgress = std::function<void(const std::string& what, double done)>;

/// Fills in the numbers of `field` that are 0 for "found": newtons_per_kcal_per_mol_angstrom, knee_kcal_per_mol and, with a
/// zero area, minimum_kcal_per_mol. Each two molecules are brought together along their centres, as their files have them,
/// and from six sides, and drawn out of where the files have them, the easiest way of 24, giving way to walls: 1 N is the
/// strongest pull of all these. The minimum is that of the descents from there and from the files' own pose. A zero area in which
/// all attraction would be is taken out again.
///
/// In      molecules      about their centres
///         centres        of each in its file [Å]
/// Out     what was found, one line for people each
/// Fails   std::invalid_argument: a minimum of more than a million pairs of atoms is to be found
std::vector<std::string> complete_molecular_scale(wire::MolecularField& field,
                                                  std::span<const docking::Molecule* const> molecules,
                                                  std::span<const Vec3> centres_angstrom,
                                                  const docking::FieldModel& model, const ScaleProgress& progress = {});

}  // namespace tandem::server
