// Closed-form contacts of a ball with a plane of a field: at most ten for any radius.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

struct ContactPoint;

inline constexpr std::size_t kMaxBallContacts = 10;

/// Returns the only plane that a ball touches, or whose gap to the ball is below the band. `centre_F` is in the field's
/// frame F. Returns null if there is no such plane or more than one, or if the ball is too deep.
///
/// In      planes  result of planes_over() for a box around the ball and the band
const FieldPlane* plane_below_ball(const DistanceField& field, PlaneSet planes, const Vec3& centre_F, double radius_m,
                                   double band_m) noexcept;

/// Appends the ball's contacts on `plane`, from the deepest point outwards, in the order of their ids.
///
/// Model   The area of a sphere of radius R between two depths is 2πR times their difference. A slice of depth
///         therefore acts like a contact at its mean depth. With the depth δ of the deepest point, the pressing cap has
///         the contact radius a, where a² = 2Rδ − ⅔δ². The cap is divided into four slices:
///         1. at most 16 µm: one contact at the deepest point, too shallow by at most half of the slice
///         2. up to 0.143 δ: one contact. With this value, the moment of friction about the normal is exact (8/15 a ×
///            force)
///         3. from 0.143 δ to 0.65 δ: a pair of contacts on each of two axes
///         4. from 0.65 δ to δ: such pairs again. The pairs are placed so that the stiffness against tilting is that of
///            the whole area: a²/4 × area
///         The part of the cap that does not press has one contact on the axis for each slice. These slices end at a
///         gap of 16, 64 and 256 µm and at the band. While nothing presses, the third slice has four contacts on a
///         ring, where the pairs will press. Force and stiffness are exact for the area and continuous in the pose. The
///         axes are fixed to the plane, so they do not turn with the ball. Points of the plane inside the ball give the
///         same force with R − δ in place of R, because their normals point to the ball's centre
/// Source  our derivation
/// In      ball_share  fraction of the force that is due to the ball's points, 0..1; the rest is due to the plane's
///         sign        sign of the plane's normal in the contacts
void add_ball_on_plane(const FieldPlane& plane, const Pose& X_WF, const Vec3& centre_F, double radius_m, double band_m,
                       double ball_share, double sign, std::vector<ContactPoint>& contacts) noexcept;

}  // namespace tandem::contact
