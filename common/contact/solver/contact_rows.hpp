// Forces of hundreds of contacts on two bodies in a step: the inner loops of the contact solver. Rows hold four
// contacts, with the four values of each quantity side by side, so that vectors are full.
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

  /// Factor of velocity in the force: the force depends on the depth at the end of the step and on the dissipation.
  double lag_s() const { return step_s + dissipation_s; }
};

/// Friction limit: μ times the normal force of this evaluation (kFollows), or of the last evaluation with kFollows
/// (kKept). Forces have a potential in the velocities only while the limit is kept.
enum class FrictionLimit : std::uint8_t { kFollows, kKept };

/// Forces of contacts at trial velocities, and their derivatives. Twists are those of A relative to B; wrenches act on
/// A.
///
/// Model   With n out of B, w = stiffness · area, δ the depth at the start, u = −n·v the closing speed, h the step,
///         τ the dissipation, ρ the rigid depth:
///         f_n = w (min(δ, ρ) + (h + τ) u)₊ + w_hard (min(δ − ρ, h·0.2 m/s) + h u)₊.
///         A soft layer with a Kelvin-Voigt damper at the end of the step, and a hard floor under it. Over a gap the
///         layer's δ is multiplied by (h + τ)/h, so that the damper begins where the surfaces meet. The floor lifts by
///         0.2 m/s at most, and the layer by ρ/(h + τ): bodies that start in overlap separate without being thrown
///         apart.
///         Friction is −k_t z clamped to length μ f_n, with z = s + r (h + τ) v_t, k_t = 0.8 w, and s the bristle: a
///         spring as long as the contact sticks, so that nothing creeps. r = f_n/(w ρ), 1 to 100: a contact on the
///         floor sticks with the stiffness with which it presses. After the step s ← s + r h v_t, at most μ f_n / k_t
///         long.
///         Both forces are dissipative. f_n h u is at least the energy gain of the layer's ½ w δ², for either sign of
///         u. The clamp, a projection on a ball, is monotone, so that friction takes at least the energy gain of s
///         while r is constant. When r falls to 1, s may return 0.6 μ² w ρ² more (8 µJ for a tip of 1 mm).
/// Source  our derivation; 0.8 is Mindlin's k_t / k_n of two elastic spheres, 2 (1 − ν)/(2 − ν), at ν = 0.3 to 0.35
class ContactRows {
 public:
  ContactRows(std::size_t contacts, std::size_t patches);
  ~ContactRows();

  void clear() noexcept { used_ = 0; }
  /// Appends rows for these contacts and stores their range in `terms`. False: no room. Contacts that are not finite
  /// get rows without force; their number is added to `ill`.
  bool append(std::span<const ContactPoint> contacts, PatchTerms& terms, std::uint32_t& ill) noexcept;

  /// Wrench on A at this twist of A past B, both about terms.about_W.
  Wrench evaluate(const PatchTerms& terms, const Twist& twist, FrictionLimit friction) noexcept;
  /// −∂wrench/∂twist at the twist of the last evaluate(): symmetric, no negative eigenvalue.
  Mat6 derivative(const PatchTerms& terms) const noexcept;

  /// Moves the bristles by the twist of the last evaluate().
  ///
  /// Out     all fields except the wrench
  PatchResult finish(const PatchTerms& terms, std::span<ContactPoint> contacts) const noexcept;

 private:
  static void set_empty(ContactRow& row, std::size_t lane) noexcept;

  std::vector<ContactRow> rows_;
  std::size_t used_ = 0;
};

}  // namespace tandem::contact
