// One implicit step of coupling, contact and friction for all bodies that tools touch. It is stable for any mass and
// any contact stiffness.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::contact {

inline constexpr int kStaticBody = -1;

/// A moving rigid body at the start of a step. C: centre of mass, axes of W.
struct SolverBody {
  double mass_kg = 0;
  Eigen::Matrix3d inertia_W = Eigen::Matrix3d::Zero();  ///< about C
  Vec3 p_WC = Vec3::Zero();
  Twist V_WC;       ///< velocity of C
  Wrench wrench_W;  ///< external wrench (weight, fields), about C
  /// The body moves with V_WC whatever pushes it: mass, inertia and wrench_W are not used. Its contacts with other
  /// bodies that do not yield have no rigid depth, since nothing could end the overlap; the layer continues instead.
  bool is_prescribed = false;
};

/// A user's coupling to a freely moving body.
struct SolverCoupling {
  int body = 0;
  const haptics::CouplingLaw* law = nullptr;
  Pose X_WH;
  Twist V_WH;
  Pose X_WT;  ///< pose of the tool, which is fixed to the body
  /// Additional damping of the tool's absolute velocity; part of the coupling.
  double brake_n_s_per_m = 0;
  double brake_n_m_s_per_rad = 0;
};

/// Stiffness of sticking friction over that of the contact's layer, see ContactRows.
inline constexpr double kTangentialRatio = 0.8;

/// The contacts of body `a` with body `b`; either may be kStaticBody, not both.
struct SolverPatch {
  int a = 0;
  int b = kStaticBody;
  std::span<ContactPoint> contacts;  ///< normals out of b; bristles are read and written
  double stiffness_n_per_m3 = 5e9;   ///< per area and depth
  double rigid_depth_m = 5e-4;       ///< beyond it, contact is as stiff as the step allows
  double friction = 0.5;
  double dissipation_s = 1e-3;  ///< damping of the normal contact: force ∝ depth + dissipation · closing speed
};

/// Result of the solver for one patch.
struct PatchResult {
  Wrench on_a_W;               ///< mean over the step, about the origin of W; on b its opposite
  double normal_force_n = 0;   ///< sum of the magnitudes
  double deepest_m = 0;        ///< deepest contact with a force, at the start of the step
  std::uint32_t pressing = 0;  ///< contacts with a force
};

struct SolverReport {
  std::uint32_t iterations = 0;  ///< Newton iterations, the maximum over the islands
  bool has_converged = true;     ///< false: the best velocities found, or free flight if they are not finite
  /// Number of unused bodies, couplings, patches and contacts: over the limits, not finite, or with a body that does
  /// not exist. An unused body stands still.
  std::uint32_t left_out = 0;
  std::uint32_t ill_formed = 0;  ///< those of `left_out` with invalid numbers
};

/// Implicit Euler with contact as a potential.
///
/// Model   For each island of bodies that touch, the velocities V that minimise
///         ½ (V − V*)ᵀ M (V − V*) + contact, friction and coupling as potentials of V (ContactRows, CouplingTerm),
///         V* = V₀ + h M⁻¹ w_ext; that is M (V − V*) = h Σ forces at the end of the step. The problem is convex.
///         Newton's method has a line search on the slope along the step. In the first iterations friction is limited
///         by the normal force of the current iterate, later by that of the last of these iterates. Contact planes and
///         inertia are those at the start of the step. The solution has no gyroscopic torque: the caller advances the
///         pose at constant angular momentum (RigidBody::advance()).
///         Beyond the rigid depth, each contact is stiff enough to stop the whole island, including the hands, from 1
///         m/s within 0.1 mm.
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
