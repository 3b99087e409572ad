// Computes the centre of mass and the inertia of a body from its shapes, so that a scene needs to give only the mass.
#pragma once

#include <vector>

#include "common/base/mass_properties.hpp"
#include "common/docking/molecule.hpp"
#include "server/physics/solid_shape.hpp"

namespace tandem::server {

/// Mass properties of solids of equal density. Overlaps count twice; a sheet counts as its convex hull.
/// Fails   std::domain_error: the shapes enclose no volume (a flat mesh)
MassProperties mass_properties_of(double mass_kg, const std::vector<SolidShape>& shapes);

/// Mass properties of the atoms of `molecule` about their centre of mass, which is its origin. The total mass is scaled
/// to `mass_kg`.
/// In      metres_per_angstrom  length scale of the scene
MassProperties mass_properties_of(double mass_kg, const docking::Molecule& molecule, double metres_per_angstrom);

}  // namespace tandem::server
