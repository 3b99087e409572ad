// Closed-form contacts of a ball with a plane of a field: at most ten for any radius.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxBallContacts = 10;

/// Returns the plane that a ball touches, or nearly touches with a gap below the band. Returns null if there is no such
/// plane, if there are several, or if the ball is too deep. `centre_F` is in the field's frame F.
///
/// In      planes  result of planes_over() for a box around the ball and the band
const FieldPlane* plane_below_ball(const DistanceField& field, PlaneSet planes, const Vec3& centre_F, double radius_m,
                                   double band_m) noexcept;

/// Appends the ball's contacts on `plane`, from the deepest point outwards, in the order of their ids.
///
/// Model   Symbols: R radius of the ball, δ depth of its deepest point, a radius of the contact: a² = 2Rδ − ⅔δ². A disc
///         of radius a has the same mean squared distance from the axis as the area of the pressing cap.
///         The area of a sphere between two heights is 2πR times their difference. One contact at the mean depth of a
///         slice therefore has the slice's force.
///         The pressing cap is divided into four slices, by height above the deepest point:
///         1. 0 to 16 µm (at most 0.143 δ): one contact on the axis. It is too shallow by at most 8 µm.
///         2. 16 µm to 0.143 δ: one contact on the axis.
///         3. 0.143 δ to 0.65 δ: a pair of contacts on the first tangent of the plane.
///         4. 0.65 δ to δ: a pair of contacts on the second tangent.
///         The distances of the pairs give the cap's stiffness against tilting, a²/4 × area. The border 0.143 gives the
///         moment of friction about the normal, 8/15 a × friction force.
///         The part of the ball with a gap is divided into slices that end at gaps of 16, 64 and 256 µm and at the
///         band. Each has one contact on the axis. Exception: while nothing presses, the third slice has four contacts
///         on a ring, because the pairs above appear there when the ball begins to press.
///         Force and stiffness are exact and continuous in the pose. The tangents are fixed to the plane, so the
///         contacts do not turn with the ball. If the plane's points are used instead of the ball's, R − δ replaces R,
///         because their normals point to the ball's centre
/// Source  our derivation
/// In      ball_share  fraction of the force that is computed from the ball's points, 0..1; the rest is computed from
///         the plane's
///         sign        +1: the contacts' normals have the direction of the plane's normal; −1: the opposite direction
void add_ball_on_plane(const FieldPlane& plane, const Pose& X_WF, const Vec3& centre_F, double radius_m, double band_m,
                       double ball_share, double sign, std::vector<ContactPoint>& contacts) noexcept;

}  // namespace tandem::contact
