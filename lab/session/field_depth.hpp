// How much energy the molecular field of a trial could have given at most.
#pragma once

#include <span>

#include "common/physics/world_description.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// From the first sample down to the bottom of the well that the deepest sample is in, in world joules, at least 0.
///
/// Model   steepest descent of the movable molecules' poses from that sample, shortened where the energy would rise
/// Source  available storage: Willems, "Dissipative dynamical systems I", Arch. Rational Mech. Anal. 45, 1972
/// Limits  of the unbounded field: where the scene's bound on forces acts, it could have given less
/// Cost    some hundred evaluations of the field
double field_depth_j(const physics::WorldDescription& world, std::span<const BodiesSample> samples);

}  // namespace tandem::lab
