// The contacts of a ball with a plane of a field, by formula: ten at most, whatever its radius.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxBallContacts = 10;

/// The one plane that a ball (its centre in the field's frame F) presses on or is about to; null: there is none, there
/// are several, or the ball is too deep in it.
///
/// In      planes  those of planes_over() all over a box around the ball and the band
const FieldPlane* plane_below_ball(const DistanceField& field, PlaneSet planes, const Vec3& centre_F, double radius_m,
                                   double band_m) noexcept;

/// Appends its contacts on that plane, from the deepest point outwards, in the order of their ids.
///
/// Model   the area of a sphere between two depths is 2πR times their difference, so slices of depth act as their means:
///         a small one at the deepest point, which hides half of 16 µm of it at most; the rest of the inner
///         m = 0.143 of the depth; a pair on each of two axes for [m, 0.65] and [0.65, 1] of it. Each pair lies where
///         the tilt is that of all (a²/4 × area; a² = 2Rδ − ⅔δ²); m is chosen so that the moment of friction about the
///         normal is too (8/15 a × force). What does not press yet is in slices that end at a gap of 16, 64 and 256 µm
///         and at the band, on the axis; while nothing presses, the third of them is four on a ring, where pairs will press.
///         Force and stiffness by area are exact, and continuous in the pose. The axes are the plane's: they do not turn
///         with the ball.
///         Points of the plane in the ball give the force with R − δ for R (their normals point to its centre)
/// Source  our derivation
/// In      ball_share  of the force that is the ball's points', the rest is the plane's; 0..1
///         sign        of the plane's normal in the contacts
void add_ball_on_plane(const FieldPlane& plane, const Pose& X_WF, const Vec3& centre_F, double radius_m, double band_m,
                       double ball_share, double sign, std::vector<ContactPoint>& contacts) noexcept;

}  // namespace tandem::contact
