// How stiff a coupling may be: it is integrated explicitly, one force a step, so what it pulls needs enough
// inertia. The scene loader refuses what would ring; the world limits what a running scene leads to.
#pragma once

#include "common/coupling.hpp"

namespace tandem {

/// What a coupling pulls, and where.
struct CoupledInertia {
  double mass_kg = 0;        ///< effective where the coupling pulls (MassProperties::mass_at_point_kg)
  double inertia_kg_m2 = 0;  ///< smallest principal moment
  int hands = 1;             ///< equal couplings that pull the same body
};

/// `coupling` with each coefficient reduced to what is stable at a step of `step_s`.
///
/// Model   symplectic Euler with the coupling force of the step's start is stable while, for every motion of the
///         body, n (k h² + 2 b h) < 4 m for n hands. We allow n k h² ≤ m/2 and n 2 b h ≤ m, and likewise k_r, b_r with
///         the inertia: the four sum to 3 of the 4 that a motion which is all of them at once may have.
/// Source  Jury's criterion on λ² − (2 − n(bh + kh²)/m) λ + (1 − n b h/m), our derivation
CouplingParameters stable_coupling(const CouplingParameters& coupling, const CoupledInertia& pulled, double step_s);

}  // namespace tandem
