#include "common/physics/touch_model.hpp"

#include <algorithm>
#include <limits>

#include "common/contact/shape_distance.hpp"

namespace tandem::physics {

double distance_m(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB,
                  double limit_m) noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  for (const TouchModel::Part& part_a : a.parts) {
    for (const TouchModel::Part& part_b : b.parts) {
      const double distance = contact::shape_distance_m(*part_a.shape, X_WA * part_a.X_BS, *part_b.shape,
                                                        X_WB * part_b.X_BS, std::min(limit_m, nearest));
      nearest = std::min(nearest, distance);
    }
  }
  return nearest;
}

bool overlaps(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB, double depth_m) noexcept {
  for (const TouchModel::Part& part_a : a.parts) {
    for (const TouchModel::Part& part_b : b.parts) {
      const Pose X_WPa = X_WA * part_a.X_BS, X_WPb = X_WB * part_b.X_BS;
      if (contact::boxes_are_near(*part_a.shape, X_WPa, *part_b.shape, X_WPb, 0) &&
          contact::overlaps(*part_a.shape, X_WPa, *part_b.shape, X_WPb, depth_m)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace tandem::physics
