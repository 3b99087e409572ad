// The contacts of two rods, parallel or crossing, by formula; their number does not depend on the thickness of the rods.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/round/rod.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxRodContacts = 24;

/// Two rods: contacts that depend on their poses, and on which side of B's axis A was.
///
/// Model   Depth along A's axis is R_A + R_B less the distance of the axes, to second order in how far A is aside of the
///         common normal. Across the axis, depth is that of parallel cylinders: a strip of A's axis ds wide with a depth δ
///         has an area of 2√(2Rδ) ds, R = R_A R_B / (R_A + R_B), and a mean depth of ⅔ δ. Five Gauss points along the part
///         of the axis that presses and is beside B give, for rods that cross at an angle θ with a depth d, the force
///         k π d² √(R_A R_B) / sin θ of the overlap (k: stiffness by area and depth) within 0.3 %; for parallel ones
///         (4/3) k √(2R) d^(3/2) by length. Each Gauss point is three contacts: the deepest fifth, and both sides.
///         A round end has an area of 2π R_eff d while it presses, R_eff that of a ball on a cylinder or on a ball; it
///         takes over as the common normal leaves the cylinder beside it. What does not press yet is one contact at the
///         nearest place, and one at each end.
///         The normal is that of the axes' nearest places. Where that is between the ends of both, A stays on the side
///         where it was: a rod that is moved through another one by more than its thickness in a step is pushed back.
/// Source  our derivation
class RodContacts {
 public:
  /// Forgets on which side A was.
  void forget() { side_B_.setZero(); }

  /// Appends the contacts, in the order of their ids. False: none, for a flat end or its edge is what is met.
  ///
  /// In      puts_on_a  places of contacts are on the surface of A, else on that of B
  bool find(const Rod& a, const Pose& X_WA, const Rod& b, const Pose& X_WB, double band_m, bool puts_on_a,
            std::vector<ContactPoint>& contacts) noexcept;

 private:
  Vec3 side_B_ = Vec3::Zero();  ///< normal of the last find() in the frame of B; zero: not known
};

}  // namespace tandem::contact
