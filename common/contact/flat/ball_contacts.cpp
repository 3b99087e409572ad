#include "common/contact/flat/ball_contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/contact/contact_point.hpp"
#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {
namespace {

// Borders between the slices of the pressing cap, as fractions of the cap's height above the deepest point. kInner is
// chosen so that the moment of friction about the normal is exact.
constexpr double kInner = 0.14288946;
constexpr double kMiddle = 0.65;
// Slices of the part of the cap that does not press: thickness of the first slice, and ratio of the thicknesses of
// successive slices. Both values are also used in plane_contacts.cpp.
constexpr double kFirstSlice_m = 1.6e-5;
constexpr double kNextSlice = 4;
constexpr int kGapSlices = 4;
// Index of the slice of the gap that has four contacts on a ring while nothing presses. When the ball begins to press,
// its pairs of contacts appear at the positions of this ring.
constexpr int kWideSlice = 2;
// Largest depth as a fraction of the radius. A deeper ball might extend through the solid below the plane.
constexpr double kMaxDepth = 0.5;

/// Returns the height of the ball's cap that can have contacts: the part of its surface that presses or has a gap below
/// the band. It is negative if the ball is out of reach, and at most a hemisphere.
double cap_height_m(double radius_m, double depth_m, double band_m) {
  return std::min(depth_m + band_m, radius_m);
}

/// Returns two tangents of a plane. They depend on its normal only, so they do not turn with the ball.
std::array<Vec3, 2> tangents_of(const Vec3& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 u = normal.cross(Vec3::Unit(least)).normalized();
  return {u, normal.cross(u)};
}

}  // namespace

const FieldPlane* plane_below_ball(const DistanceField& field, PlaneSet planes, const Vec3& centre_F, double radius_m,
                                   double band_m) noexcept {
  const std::span<const FieldPlane> all = field.planes();
  const FieldPlane* nearest = nullptr;
  for (PlaneSet rest = planes; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = all[static_cast<std::size_t>(std::countr_zero(rest))];
    if (nearest == nullptr || plane.distance_m(centre_F) > nearest->distance_m(centre_F)) nearest = &plane;
  }
  if (nearest == nullptr) return nullptr;
  const double depth_m = radius_m - nearest->distance_m(centre_F);
  if (depth_m > kMaxDepth * radius_m) return nullptr;
  const double cap_m = cap_height_m(radius_m, depth_m, band_m);
  if (cap_m <= 0) return nullptr;
  const auto [u, v] = tangents_of(nearest->normal);
  OrientedBox box;
  box.axes << u, v, nearest->normal;
  box.centre = centre_F - (radius_m - cap_m / 2) * nearest->normal;
  const double half_m = std::sqrt(cap_m * (2 * radius_m - cap_m));
  box.half_m = Vec3(half_m, half_m, cap_m / 2);
  // In a sampled field, a ball beside an edge may touch a second plane although the tests above found only one. The
  // found plane must therefore have the largest distance in the whole cap.
  const PlaneSet nearest_alone = PlaneSet{1} << static_cast<unsigned>(nearest - all.data());
  return largest_over(all, planes, box) == nearest_alone ? nearest : nullptr;
}

void add_ball_on_plane(const FieldPlane& plane, const Pose& X_WF, const Vec3& centre_F, double radius_m, double band_m,
                       double ball_share, double sign, std::vector<ContactPoint>& contacts) noexcept {
  const double height_m = plane.distance_m(centre_F);
  const double depth_m = radius_m - height_m;
  const double pressing_m = std::max(0.0, depth_m);
  const double area_per_depth_m = 2 * std::numbers::pi * (radius_m - (1 - ball_share) * pressing_m);
  const Eigen::Matrix3d R_WF = X_WF.q.toRotationMatrix();
  const Vec3 normal_W = R_WF * plane.normal;
  const Vec3 centre_W = R_WF * centre_F + X_WF.p;
  std::uint32_t id = ContactPoint::kClosedForm;
  // Adds a contact for the part of the sphere between two heights above its lowest point. The area of the contact is
  // multiplied by `share`.
  const auto add = [&](double begin_m, double end_m, double share, const Vec3& aside_W) {
    const std::uint32_t own_id = id++;
    if (!(end_m > begin_m)) return;
    ContactPoint& contact = contacts.emplace_back();
    contact.depth_m = depth_m - (begin_m + end_m) / 2;
    contact.p_W = centre_W - (height_m + contact.depth_m) * normal_W + aside_W;
    contact.normal_W = sign * normal_W;
    contact.area_m2 = share * (end_m - begin_m) * area_per_depth_m;
    contact.id = own_id;
  };
  const std::array<Vec3, 2> tangents_F = tangents_of(plane.normal);
  const auto add_pair = [&](double begin_m, double end_m, double share, const Vec3& aside_F) {
    const Vec3 aside_W = R_WF * aside_F;
    add(begin_m, end_m, share / 2, -aside_W);
    add(begin_m, end_m, share / 2, aside_W);
  };
  const bool is_pressing = depth_m > 0;
  if (is_pressing) {
    const double inner_m = kInner * depth_m, middle_m = kMiddle * depth_m, first_m = std::min(kFirstSlice_m, inner_m);
    const double disc_m = std::sqrt(depth_m * (2 * radius_m - depth_m * 2 / 3));
    add(0, first_m, 1, Vec3::Zero());
    add(first_m, inner_m, 1, Vec3::Zero());
    add_pair(inner_m, middle_m, 1, disc_m * 0.5 / std::sqrt(kMiddle - kInner) * tangents_F[0]);
    add_pair(middle_m, depth_m, 1, disc_m * 0.5 / std::sqrt(1 - kMiddle) * tangents_F[1]);
  }
  const double cap_m = cap_height_m(radius_m, depth_m, band_m);
  double begin_m = pressing_m;
  double slice_m = kFirstSlice_m;
  for (int i = 0; i < kGapSlices; ++i, slice_m *= kNextSlice) {
    const double end_m = i + 1 == kGapSlices ? cap_m : std::min(cap_m, pressing_m + slice_m);
    if (i == kWideSlice && !is_pressing) {
      const double middle_m = (begin_m + end_m) / 2, ring_m = std::sqrt(middle_m * (2 * radius_m - middle_m));
      for (const Vec3& tangent_F : tangents_F) add_pair(begin_m, end_m, 0.5, ring_m * tangent_F);
    } else {
      add(begin_m, end_m, 1, Vec3::Zero());
    }
    begin_m = end_m;
  }
}

}  // namespace tandem::contact
