// What one contact does to two bodies in a step, for hundreds of contacts at once: the inner loops of the contact
// solver. Stored by four, each quantity of the four side by side, so that vectors are full.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/contact/block_cholesky.hpp"
#include "common/contact/contact_solver.hpp"

namespace tandem::contact {

struct ContactRow;

/// What all contacts of a patch have in common, and where its rows are.
struct PatchTerms {
  Vec3 about_W = Vec3::Zero();  ///< twists and wrenches of the patch are taken here
  double step_s = 0;
  double stiffness_n_per_m3 = 0;
  double dissipation_s = 0;
  double friction = 0;
  double rigid_depth_m = 0;
  double hard_n_per_m = 0;  ///< stiffness of each contact beyond the rigid depth
  std::size_t first = 0;
  std::size_t end = 0;

  /// A force answers to where the contact will be at the end of the step, and to its dissipation.
  double lag_s() const { return step_s + dissipation_s; }
};

/// Whether friction is limited by μ times the normal force of this evaluation, or of the last one that said so. Forces
/// have a potential in the velocities only while the limit is kept.
enum class FrictionLimit : std::uint8_t { kFollows, kKept };

/// Forces of contacts at trial velocities, and their derivatives. Twists are of A past B, wrenches on A.
///
/// Model   With n out of B, w = stiffness · area, δ the depth at the start, u = −n·v the closing speed, h the step,
///         τ the dissipation, ρ the rigid depth:
///         f_n = w (min(δ, ρ) + (h + τ) u)₊ + w_hard (min(δ − ρ, h·0.2 m/s) + h u)₊.
///         A soft layer with a Kelvin-Voigt damper at the end of the step, and a hard floor under it. Over a gap the
///         layer's δ is taken (h + τ)/h times, so that the damper begins where the surfaces meet. The floor lifts by
///         0.2 m/s at most, and the layer by ρ/(h + τ): what starts in overlap comes out, but is not thrown out.
///         Friction is −k_t z clamped to length μ f_n, with z = s + r (h + τ) v_t, k_t = 0.8 w, and s the bristle: a
///         spring as long as the contact sticks, so that nothing creeps. r = f_n/(w ρ), 1 to 100: what stands on the
///         floor sticks as firmly as it presses. After the step s ← s + r h v_t, at most μ f_n / k_t long.
///         Both only take energy: f_n h u is at least what the layer's ½ w δ² gains, for either sign of u; and the
///         clamp, a projection on a ball, is monotone, so that friction takes at least what s gains while r stays; when r falls
///         to 1, s may give back 0.6 μ² w ρ² more (8 µJ for a tip of 1 mm).
/// Source  our derivation; 0.8 is Mindlin's k_t / k_n of two elastic spheres, 2 (1 − ν)/(2 − ν), at ν = 0.3 to 0.35
class ContactRows {
 public:
  ContactRows(std::size_t contacts, std::size_t patches);
  ~ContactRows();

  void clear() noexcept { used_ = 0; }
  /// Rows of these contacts, whose range goes to `terms`. False: no room. Contacts that are not finite get rows without
  /// any force; their number is added to `ill`.
  bool append(std::span<const ContactPoint> contacts, PatchTerms& terms, std::uint32_t& ill) noexcept;

  /// Wrench on A at this twist of A past B, both about terms.about_W.
  Wrench evaluate(const PatchTerms& terms, const Twist& twist, FrictionLimit friction) noexcept;
  /// −∂wrench/∂twist where evaluate() was last asked: symmetric, no negative eigenvalue.
  Mat6 derivative(const PatchTerms& terms) const noexcept;

  /// Moves the bristles by the twist of the last evaluate().
  /// Out     all but the wrench
  PatchResult finish(const PatchTerms& terms, std::span<ContactPoint> contacts) const noexcept;

 private:
  static void set_empty(ContactRow& row, std::size_t lane) noexcept;

  std::vector<ContactRow> rows_;
  std::size_t used_ = 0;
};

}  // namespace tandem::contact
