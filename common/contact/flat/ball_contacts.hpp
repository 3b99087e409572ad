// Closed-form contacts of a ball with a plane of a field: ten at most, whatever its radius.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxBallContacts = 10;

/// The only plane that a ball (its centre in the field's frame F) presses on, or may press on within the band. Null:
/// there is none or more than one, or the ball is too deep in it.
///
/// In      planes  result of planes_over() for a box around the ball and the band
const FieldPlane* plane_below_ball(const DistanceField& field, PlaneSet planes, const Vec3& centre_F, double radius_m,
                                   double band_m) noexcept;

/// Appends the ball's contacts on that plane, from the deepest point outwards, in the order of their ids.
///
/// Model   The area of a sphere between two depths is 2πR times their difference, so slices of depth act as their
///         means. A small slice lies at the deepest point and hides at most half of 16 µm of depth. A second one is the
///         rest of the inner m = 0.143 of the depth. A pair on each of two axes represents [m, 0.65] and [0.65, 1] of
///         the depth. Each pair lies where the tilt equals that of all (a²/4 × area; a² = 2Rδ − ⅔δ²). m is chosen so
///         that the moment of friction about the normal is exact, too (8/15 a × force). The part that does not press
///         yet is divided into slices on the axis, which end at a gap of 16, 64 and 256 µm and at the band. While
///         nothing presses, the third slice is four contacts on a ring, where pairs will press.
///         Force and stiffness by area are exact, and continuous in the pose. The axes are the plane's: they do not
///         turn with the ball.
///         Points of the plane in the ball give the force with R − δ for R (their normals point to its centre)
/// Source  our derivation
/// In      ball_share  share of the force from the ball's points, 0..1; the rest is from the plane's
///         sign        sign of the plane's normal in the contacts
void add_ball_on_plane(const FieldPlane& plane, const Pose& X_WF, const Vec3& centre_F, double radius_m, double band_m,
                       double ball_share, double sign, std::vector<ContactPoint>& contacts) noexcept;

}  // namespace tandem::contact
