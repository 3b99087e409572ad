// Computes the forces of the contacts between two bodies: the inner loops of the contact solver, with hundreds of
// contacts in a step. A row holds four contacts; each quantity is a vector of their four values.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/contact/solver/block_cholesky.hpp"
#include "common/contact/solver/solver_types.hpp"

namespace tandem::contact {

struct ContactRow;

/// Common parameters of a patch's contacts, and the range of its rows.
struct PatchTerms {
  Vec3 about_W = Vec3::Zero();  ///< reference point of the patch's twists and wrenches
  double step_s = 0;
  double stiffness_n_per_m3 = 0;
  double dissipation_s = 0;
  double friction = 0;
  double rigid_depth_m = 0;
  double hard_n_per_m = 0;  ///< stiffness of each contact beyond the rigid depth
  std::size_t first = 0;
  std::size_t end = 0;

  /// Returns the factor of the closing speed in the normal force: step + dissipation. The step is included because the
  /// force depends on the depth at the end of the step.
  double lag_s() const { return step_s + dissipation_s; }
};

/// Limit of the friction, μ times a normal force:
/// * kFollows: the normal force of this evaluation.
/// * kKept: the normal force of the last evaluation with kFollows. Only with this limit, friction forces are the
///   derivative of a potential of the velocities.
enum class FrictionLimit : std::uint8_t { kFollows, kKept };

/// Computes the forces of contacts, and their derivatives, at trial velocities. Twists are those of A relative to B;
/// wrenches act on A.
///
/// Model   Symbols:
///         n, v     unit normal out of B, velocity of A relative to B at the contact, with the tangential part v_t
///         w, k_t   normal stiffness (stiffness_n_per_m3 · area), tangential stiffness 0.8 w
///         w_hard   stiffness of the hard floor (hard_n_per_m)
///         δ, u     depth at the start of the step, closing speed −n·v
///         h, τ, ρ  step, dissipation, rigid depth
///         s        bristle: tangential displacement since sticking began
///         (x)₊     max(x, 0)
///         Normal force f_n = w (min(δ, ρ) + (h + τ) u)₊ + w_hard (min(δ − ρ, h·0.2 m/s) + h u)₊.
///         1. The first term is a soft layer with a Kelvin-Voigt damper, evaluated at the end of the step. The second
///            term is a hard floor under the layer.
///         2. For a gap, the layer's δ is multiplied by (h + τ)/h, so that the damper acts only from the moment of
///            touching.
///         3. Overlapping bodies are not thrown apart: the floor separates them at 0.2 m/s at most, the layer at
///            ρ/(h + τ) at most.
///         Friction is −k_t z clamped to the length μ f_n, where z = s + r (h + τ) v_t.
///         1. While the contact sticks, friction is thus a spring, and a body at rest does not creep.
///         2. The factor r = f_n/(w ρ), limited to 1 to 100, makes friction stiffer for a contact on the hard floor, in
///            proportion to its normal force.
///         3. After the step, the bristle is s + r h v_t, at most μ f_n / k_t long.
///         Both forces are dissipative:
///         1. For either sign of u, the normal force does the work f_n h u, which is at least the increase of the
///            layer's energy ½ w δ².
///         2. While r is constant, friction dissipates at least the increase of the energy stored in s, because the
///            clamp (a projection on a ball) is monotone. Exception: when r falls to 1, s may return 0.6 μ² w ρ² more
///            (8 µJ for a tip of 1 mm)
/// Source  our derivation; 0.8 is Mindlin's ratio k_t / k_n of two elastic spheres, 2 (1 − ν)/(2 − ν), for a Poisson's
///         ratio ν of 0.3 to 0.35
class ContactRows {
 public:
  ContactRows(std::size_t contacts, std::size_t patches);
  ~ContactRows();

  void clear() noexcept { used_ = 0; }
  /// Appends rows for these contacts and stores their range in `terms`. Returns false if the capacity does not suffice.
  /// Contacts with a number that is not finite, without a positive area, or with a normal that is no unit vector are
  /// invalid. They have no force, and `ill` counts them.
  bool append(std::span<const ContactPoint> contacts, PatchTerms& terms, std::uint32_t& ill) noexcept;

  /// Returns the wrench on A for this twist of A relative to B, both about terms.about_W.
  Wrench evaluate(const PatchTerms& terms, const Twist& twist, FrictionLimit friction) noexcept;
  /// Returns −∂wrench/∂twist at the twist of the last evaluate(). The matrix is symmetric and positive semidefinite.
  Mat6 derivative(const PatchTerms& terms) const noexcept;

  /// Updates the bristles (tangential displacements) of `contacts` with the twist of the last evaluate().
  ///
  /// Out     all fields of the result except the wrench
  PatchResult finish(const PatchTerms& terms, std::span<ContactPoint> contacts) const noexcept;

 private:
  static void set_empty(ContactRow& row, std::size_t lane) noexcept;

  std::vector<ContactRow> rows_;
  std::size_t used_ = 0;
};

}  // namespace tandem::contact
