// Centre of mass and inertia of a body from its shapes, so that an author gives one number: the mass.
#pragma once

#include <vector>

#include "common/base/mass_properties.hpp"
#include "common/docking/molecule.hpp"
#include "server/physics/solid_shape.hpp"

namespace tandem::server {

/// Of solids of one density. Where shapes overlap, the overlap counts twice; a sheet counts as its convex hull.
/// Fails   std::domain_error when the shapes enclose no volume (a flat mesh)
MassProperties mass_properties_of(double mass_kg, const std::vector<SolidShape>& shapes);

/// Of atoms about their centre of mass, which is the origin of `molecule`, with its mass scaled to `mass_kg`.
/// In      metres_per_angstrom  S_x
MassProperties mass_properties_of(double mass_kg, const docking::Molecule& molecule, double metres_per_angstrom);

}  // namespace tandem::server
