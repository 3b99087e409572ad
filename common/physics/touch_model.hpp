// A body as tools feel it: its shapes ready for contact.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/contact_shape.hpp"

namespace tandem::physics {

/// Immutable while a scene runs.
struct TouchModel {
  struct Part {
    std::shared_ptr<const contact::ContactShape> shape;
    Pose X_BS;
  };
  std::vector<Part> parts;           ///< none: cannot be touched (a molecule)
  double radius_m = 0;               ///< of the ball about the body's origin that holds all parts
  double stiffness_n_per_m3 = 1e10;  ///< of its surface; two surfaces in contact act as springs in a row

  bool can_be_touched() const { return !parts.empty(); }
};

/// Gap between two bodies, negative when they overlap; infinite when it is more than `limit_m`.
double distance_m(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB,
                  double limit_m) noexcept;

/// Whether one is deeper than `depth_m` in the other.
bool overlaps(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB, double depth_m) noexcept;

}  // namespace tandem::physics
