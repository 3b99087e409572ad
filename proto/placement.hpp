// Converts a placement to a pose. Server and client share this code, because neither depends on the other.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/spatial.hpp"
#include "proto/state.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Returns the pose of a placement; absent numbers are treated as 0.
///
/// Model   R = R_z(γ) · R_y(β) · R_x(α): rotations about the fixed axes x, then y, then z
/// Out     pose; finite if and only if the numbers are finite. The caller checks how many there are, and their ranges
inline Pose pose_from_placement(const wire::Placement& placement) {
  const auto vector_of = [](const google::protobuf::RepeatedField<double>& numbers) {
    return numbers.size() == 3 ? Vec3(numbers[0], numbers[1], numbers[2]) : Vec3(0, 0, 0);
  };
  const Vec3 angles = vector_of(placement.rotation_xyz_deg()) * (std::numbers::pi / 180.0);
  const Quat rotation = Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) *
                        Eigen::AngleAxisd(angles.x(), Vec3::UnitX());
  return {vector_of(placement.position_m()), rotation.normalized()};
}

/// Returns whether the field holds the three coordinates of a position within the limits of a scene.
inline bool is_place(const google::protobuf::RepeatedField<double>& metres) {
  return metres.size() == 3 && std::ranges::all_of(metres, [](double x) { return std::abs(x) <= kMaxPositionM; });
}

}  // namespace tandem::proto
