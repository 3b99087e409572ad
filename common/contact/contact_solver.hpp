// One implicit time step of coupling, contact and friction for all bodies that tools touch. The step is stable for any
// mass and any contact stiffness.
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
  /// Number of bodies, couplings, patches and contacts that were ignored, for one of three reasons: they exceed a
  /// limit, they are not finite, or they refer to a body that does not exist. An ignored body does not move.
  std::uint32_t left_out = 0;
  std::uint32_t ill_formed = 0;  ///< number of ignored inputs that were invalid (not finite, or with a missing body)
};

/// Computes one time step of all bodies by implicit Euler. Contact forces are the derivative of a potential of the
/// velocities.
///
/// Model   An island is a group of bodies that touch. The velocities V of its bodies at the end of the step minimise
///           ½ (V − V*)ᵀ M (V − V*) + potentials of contact, friction and coupling (ContactRows, CouplingTerm)
///         with the mass matrix M. V* = V₀ + h M⁻¹ w_ext are the velocities without contact: V₀ at the start, step h,
///         external wrench w_ext. At the minimum, M (V − V*) = h Σ forces at the end of the step.
///         1. The problem is convex. It is solved by Newton's method with a line search along each Newton step.
///         2. In the first iterations, friction is limited by the normal force of the current iterate. In later ones,
///            this limit is kept constant.
///         3. Contact planes and inertia are those at the start of the step.
///         4. There is no gyroscopic torque, because the caller advances the pose at constant angular momentum
///            (RigidBody::advance()).
///         5. Beyond the rigid depth of its patch, each contact is stiff enough to stop the whole island, including the
///            hands, from 1 m/s within 0.1 mm
/// Source  our derivation
/// Fails   see SolverReport; outputs are always finite
/// Cost    linear in contacts, cubic in the bodies of an island; one body at rest on 285 contacts: 8 µs
/// Thread  any, one at a time; after construction no allocation as long as the limits hold
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

  /// Writes the velocities at the end of the step to `bodies[i].V_WC`. The caller advances the poses with these
  /// velocities and passes the inertia in the new attitude to the next step.
  ///
  /// Out     results          results[i] belongs to patches[i]
  ///         tool_wrenches_W  mean wrench over the step of couplings[i] on its tool, about the tool's origin
  SolverReport step(double step_s, std::span<SolverBody> bodies, std::span<const SolverCoupling> couplings,
                    std::span<const SolverPatch> patches, std::span<PatchResult> results,
                    std::span<Wrench> tool_wrenches_W) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::contact
