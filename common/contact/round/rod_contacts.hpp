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
///         1. The depth along A's axis is R_A + R_B less the distance of the axes, to second order in the distance from
///            the common normal. Across the axis, the depth is that of parallel cylinders. A strip of A's axis that is
///            ds long and δ deep has an area of 2√(2Rδ) ds and a mean depth of ⅔ δ.
///         2. Five Gauss points are spread over the part of the axis that presses and is beside B. Each has three
///            contacts: one for the middle fifth of the strip's width, which is the deepest, and one on either side of
///            it.
///         3. For rods that cross at an angle θ with a depth d, the force is that of the overlap with an error up to
///            0.3 %: k π d² √(R_A R_B) / sin θ. For parallel rods, the force per length is (4/3) k √(2R) d^(3/2).
///         4. A pressing round end has an area of 2π R_eff d, where R_eff is the effective radius of a ball on a
///            cylinder or on a ball. If the common normal meets the axis beyond the end of the cylinder, the end's
///            contact replaces that of the cylinder.
///         5. Rods that do not press have one contact at the nearest points and one at each end.
///         6. The normal is along the line between the nearest points of the axes. If these points are between the ends
///            of both axes, A stays on its previous side of B. A rod that passes through the other rod within a step,
///            by more than its thickness, is thus pushed back.
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
