// Distance between two shapes. It decides whether a hand can grab a body, and whether two bodies have separated.
#pragma once

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

/// Returns the gap between the surfaces. It is negative if they overlap, and infinite if it exceeds `limit_m`.
///
/// Model   1. The point of either shell with the smallest distance in the other shape's field is found by branch and
///            bound in the trees of the shells.
///         2. For a gap, the distance is refined: the point is projected alternately onto both surfaces (von Neumann).
///         Overlap is not refined, so it is accurate only to the spacing of the points
/// Thread  any; no allocation
double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept;

/// Returns whether a surface point of either shape is deeper than `depth_m` inside the other.
///
/// Cost    less than shape_distance_m() for deep overlap, because it stops at the first such point
bool overlaps(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
              double depth_m) noexcept;

/// Returns false if the bounding boxes are farther apart than `gap_m`. This is a fast test before the functions above.
bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept;

}  // namespace tandem::contact
