// Distance between two shapes, for grabbing and for detecting that two bodies have separated.
#pragma once

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

/// Gap between the surfaces, negative when they overlap; infinite when it is more than `limit_m`.
///
/// Model   Smallest distance of a point of either shell in the other's field, found by branch and bound over the
///         shells' trees. It is refined by alternating projections between the surfaces (von Neumann). Overlap is
///         accurate to the spacing of the shells' points
/// Thread  any; no allocation
double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept;

/// Whether a point of either shell is deeper than `depth_m` in the other's field.
///
/// Cost    ends at the first such point: much less than shape_distance_m() for shapes that are deep in each other
bool overlaps(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
              double depth_m) noexcept;

/// False only when the bounding boxes are farther apart than `gap_m`; cheap.
bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept;

}  // namespace tandem::contact
