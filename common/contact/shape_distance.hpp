// Distance between two shapes, for grabbing and for detecting that two bodies have separated.
#pragma once

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

/// Returns the gap between the surfaces. It is negative if they overlap, and infinite if it exceeds `limit_m`.
///
/// Model   Smallest distance of a point of either shell in the other's field, found by branch and bound over the
///         shells' trees. It is refined by alternating projections between the surfaces (von Neumann). Overlap is
///         accurate to the spacing of the shells' points
/// Thread  any; no allocation
double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept;

/// Returns whether a surface point of either shape is deeper than `depth_m` inside the other.
///
/// Cost    ends at the first such point, so shapes that overlap deeply take much less than with shape_distance_m()
bool overlaps(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
              double depth_m) noexcept;

/// Returns false only if the bounding boxes are farther apart than `gap_m`. Cheap.
bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept;

}  // namespace tandem::contact
