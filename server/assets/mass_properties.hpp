// Computes the centre of mass and the inertia of a body from its shapes, so that a scene needs to give only the mass.
#pragma once

#include <vector>

#include "common/base/mass_properties.hpp"
#include "common/docking/molecule.hpp"
#include "server/physics/solid_shape.hpp"

namespace tandem::server {

/// Returns the mass properties of solids of equal density. Where two shapes overlap, the volume counts twice. A sheet
/// encloses no volume and is replaced by its convex hull.
/// Fails   std::domain_error: the shapes enclose no volume (a flat mesh)
MassProperties mass_properties_of(double mass_kg, const std::vector<SolidShape>& shapes);

/// Returns the mass properties of the atoms of `molecule` about its origin, which is its centre of mass. The masses are
/// scaled to a total of `mass_kg`.
/// In      metres_per_angstrom  length scale of the scene
MassProperties mass_properties_of(double mass_kg, const docking::Molecule& molecule, double metres_per_angstrom);

}  // namespace tandem::server
