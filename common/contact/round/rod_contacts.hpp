// Closed-form contacts of two rods, parallel or crossing. Their number does not depend on the thickness of the rods.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/round/rod.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxRodContacts = 24;

/// Contacts of two rods. They depend on the poses, and on the side of B's axis where A was in the previous find().
///
/// Model   Symbols: R_A and R_B radii, R = R_A R_B / (R_A + R_B), k stiffness by area and depth.
///         1. Depth at a point of A's axis: R_A + R_B less the distance from B's axis. It is approximated by a parabola
///            along A's axis, to second order about the common normal of the axes.
///         2. A piece of A's axis that is ds long and δ deep presses with a strip. As between parallel cylinders, the
///            strip's area is 2√(2Rδ) ds and its mean depth is ⅔ δ.
///         3. Five strips are at the Gauss points of the part of A's axis that presses and is beside B. Each strip has
///            three contacts: one for the middle fifth of its width, which is the deepest, and one on either side.
///         4. For rods that cross at an angle θ with a depth d, the force is that of the overlap, k π d² √(R_A R_B) /
///            sin θ, with an error of at most 0.3 %. For parallel rods, the force per length is (4/3) k √(2R) d^(3/2).
///         5. A pressing round end has an area of 2π R_eff d, where R_eff is the effective radius of a ball on a
///            cylinder or on a ball. Where the nearest point is on the round end, the end's contacts replace the
///            strips.
///         6. Rods that do not press have one contact at the nearest points and one at each end.
///         7. The normal is along the line between the nearest points of the axes. If both points are between the ends,
///            A stays on its previous side of B. Thus, a rod that passes through another one in a step is pushed back.
/// Source  our derivation
class RodContacts {
 public:
  /// Discards the stored side of A.
  void forget() { side_B_.setZero(); }

  /// Appends the contacts, in the order of their ids. Returns false if a flat end or its edge is in contact, which has
  /// no closed form.
  ///
  /// In      puts_on_a  true: contact positions are on the surface of A; false: on that of B
  bool find(const Rod& a, const Pose& X_WA, const Rod& b, const Pose& X_WB, double band_m, bool puts_on_a,
            std::vector<ContactPoint>& contacts) noexcept;

 private:
  Vec3 side_B_ = Vec3::Zero();  ///< normal of the last find() in the frame of B; zero: unknown
};

}  // namespace tandem::contact
