// One implicit step of coupling, contact and friction for all bodies that tools touch. It is stable for any mass and
// any contact stiffness.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/solver/solver_types.hpp"

namespace tandem::contact {

struct SolverReport {
  std::uint32_t iterations = 0;  ///< Newton iterations, the maximum over the islands
  /// If false, the velocities are the best ones found, or those of free flight if these are not finite.
  bool has_converged = true;
  /// Number of unused bodies, couplings, patches and contacts: over the limits, not finite, or with a body that does
  /// not exist. An unused body does not move.
  std::uint32_t left_out = 0;
  std::uint32_t ill_formed = 0;  ///< number of items of left_out that had invalid input
};

/// Computes one time step of all bodies by implicit Euler. The force of contact is the derivative of a potential of the
/// velocities.
///
/// Model   For each island of bodies that touch, the velocities V that minimise
///         ½ (V − V*)ᵀ M (V − V*) + contact, friction and coupling as potentials of V (ContactRows, CouplingTerm),
///         V* = V₀ + h M⁻¹ w_ext; that is M (V − V*) = h Σ forces at the end of the step. The problem is convex.
///         Newton's method has a line search on the slope along the step. In the first iterations friction is limited
///         by the normal force of the current iterate, later by that of the last of these iterates. Contact planes and
///         inertia are those at the start of the step. The solution has no gyroscopic torque: the caller advances the
///         pose at constant angular momentum (RigidBody::advance()).
///         Beyond the rigid depth of its patch, each contact is stiff enough to stop the whole island, including the
///         hands, from 1 m/s within 0.1 mm.
/// Source  our derivation
/// Fails   see SolverReport; outputs are always finite
/// Cost    linear in contacts, cubic in the bodies of an island; one body at rest on 285 contacts: 8 µs
/// Thread  one at a time; after construction no allocation as long as the limits hold
class ContactSolver {
 public:
  struct Limits {
    std::size_t bodies = 24;
    std::size_t couplings = 16;
    std::size_t patches = 64;
    std::size_t contacts = 16384;
    std::uint32_t iterations = 30;
  };
  explicit ContactSolver(const Limits& limits);
  ~ContactSolver();

  /// Writes the velocities at the end of the step to `bodies[i].V_WC`. The caller advances the poses with them and
  /// passes the inertia of the new attitude in the next step.
  ///
  /// Out     results[i] of patches[i]; tool_wrenches_W[i] of couplings[i], about the tool's origin, mean over the step
  SolverReport step(double step_s, std::span<SolverBody> bodies, std::span<const SolverCoupling> couplings,
                    std::span<const SolverPatch> patches, std::span<PatchResult> results,
                    std::span<Wrench> tool_wrenches_W) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::contact
