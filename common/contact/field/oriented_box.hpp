// Boxes of any orientation, and the selection of those planes that have the largest distance somewhere in a box.
#pragma once

#include <span>

#include "common/base/spatial.hpp"
#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

/// A box of any orientation.
struct OrientedBox {
  Vec3 centre = Vec3::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< directions of the box's edges: unit columns
  Vec3 half_m = Vec3::Zero();

  OrientedBox moved(const Eigen::Matrix3d& R_FB, const Vec3& p_FB) const {
    return {R_FB * centre + p_FB, R_FB * axes, half_m};
  }
  /// Returns the maximum of n·p over the box minus n·p at its centre.
  double reach_m(const Vec3& normal) const { return (axes.transpose() * normal).cwiseAbs().dot(half_m); }
};

/// Returns the maximum of the signed distances from a set of planes to a point; minus infinity for an empty set.
double largest_m(std::span<const FieldPlane> planes, PlaneSet set, const Vec3& p);

/// Returns the planes of a set that have the largest signed distance at some point of a box.
PlaneSet largest_over(std::span<const FieldPlane> planes, PlaneSet set, const OrientedBox& box);

}  // namespace tandem::contact
