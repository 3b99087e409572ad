// Distance between two shapes. It decides whether a hand can grab a body, and whether two bodies have separated.
#pragma once

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

/// Returns the gap between the surfaces. It is negative if they overlap, and infinite if it exceeds `limit_m`.
///
/// Model   Smallest distance of a point of either shell in the other shape's field, found by branch and bound over the
///         trees of the shells. It is refined by alternating projections onto both surfaces (von Neumann). Overlap is
///         accurate to the spacing of the shells' points
/// Thread  any; no allocation
double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept;

/// Returns whether a surface point of either shape is deeper than `depth_m` inside the other.
///
/// Cost    stops at the first such point, so for deep overlap it takes much less time than shape_distance_m()
bool overlaps(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
              double depth_m) noexcept;

/// Returns false if the bounding boxes are farther apart than `gap_m`. This is a fast test before the functions above.
bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept;

}  // namespace tandem::contact
