// One step of everything that tools touch: coupling, contact and friction solved together, implicitly, so that no mass
// is too light and no contact too stiff.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::contact {

inline constexpr int kStaticBody = -1;

/// A rigid body that moves, at the start of a step. C: centre of mass, axes of W.
struct SolverBody {
  double mass_kg = 0;
  Eigen::Matrix3d inertia_W = Eigen::Matrix3d::Zero();  ///< about C
  Vec3 p_WC = Vec3::Zero();
  Twist V_WC;       ///< of C
  Wrench wrench_W;  ///< from outside (weight, fields), about C
  /// Moves as V_WC says, whatever pushes it: mass, inertia and wrench_W are not used. Against others that do not yield
  /// it has no rigid depth, for nothing there could end the overlap: the layer goes on.
  bool is_prescribed = false;
};

/// A user's coupling to a body that moves freely.
struct SolverCoupling {
  int body = 0;
  const haptics::CouplingLaw* law = nullptr;
  Pose X_WH;
  Twist V_WH;
  Pose X_WT;  ///< the tool, fixed to the body
  /// Beside it, what the tool does in the world is held back by these times its velocity: a part of the coupling.
  double brake_n_s_per_m = 0;
  double brake_n_m_s_per_rad = 0;
};

/// Of a contact, the stiffness of friction while it sticks over that of its layer, see ContactRows.
inline constexpr double kTangentialRatio = 0.8;

/// The contacts of body `a` with body `b`; either may be kStaticBody, not both.
struct SolverPatch {
  int a = 0;
  int b = kStaticBody;
  std::span<ContactPoint> contacts;  ///< normals out of b; bristles are read and written
  double stiffness_n_per_m3 = 5e9;   ///< per area and depth
  double rigid_depth_m = 5e-4;       ///< beyond, as hard as the step allows
  double friction = 0.5;
  double dissipation_s = 1e-3;  ///< damping of the normal contact: force ∝ depth + dissipation · closing speed
};

/// What the solver found for one patch.
struct PatchResult {
  Wrench on_a_W;               ///< mean over the step, about the origin of W; on b its opposite
  double normal_force_n = 0;   ///< sum of the magnitudes
  double deepest_m = 0;        ///< of the contacts with a force, at the start of the step
  std::uint32_t pressing = 0;  ///< contacts with a force
};

struct SolverReport {
  std::uint32_t iterations = 0;  ///< of Newton's method, the most of any island
  bool has_converged = true;     ///< false: the best velocities found; free flight where not even those are finite
  /// Bodies, couplings, patches and contacts that were not used: beyond the limits, not finite, or of a body that is
  /// not there. Such a body stands still.
  std::uint32_t left_out = 0;
  std::uint32_t ill_formed = 0;  ///< of these, by bad numbers and not for want of room
};

/// Implicit Euler with contact as a potential.
///
/// Model   For each island of bodies that touch: the velocities V that minimise
///         ½ (V − V*)ᵀ M (V − V*) + contact, friction and coupling as potentials of V (ContactRows, CouplingTerm),
///         V* = V₀ + h M⁻¹ w_ext; that is M (V − V*) = h Σ forces at the end of the step. Convex; Newton's method with
///         a line search on the slope along the step. In the first iterations friction is limited by the normal force
///         of the iterate, then by the last of those. Contact planes are those of the start of the step, and so is the
///         inertia. The solution has no gyroscopic torque: the caller advances the pose at constant angular momentum
///         (RigidBody::advance()).
///         Beyond the rigid depth each contact is as stiff as stops the whole island, hands and all, within 0.1 mm from
///         1 m/s.
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

  /// Velocities at the end of the step into `bodies[i].V_WC`. The caller advances the poses with them and
  /// passes the inertia of the new attitude in the next step.
  /// Out     results[i] of patches[i]; tool_wrenches_W[i] of couplings[i], about the tool's origin, mean over the step
  SolverReport step(double step_s, std::span<SolverBody> bodies, std::span<const SolverCoupling> couplings,
                    std::span<const SolverPatch> patches, std::span<PatchResult> results,
                    std::span<Wrench> tool_wrenches_W) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::contact
