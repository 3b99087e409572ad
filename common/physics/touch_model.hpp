// Contact geometry of a body: shapes that are ready for contact.
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
  std::vector<Part> parts;           ///< empty: cannot be touched, such as a molecule
  double radius_m = 0;               ///< radius of the ball about the body's origin that contains all parts
  double stiffness_n_per_m3 = 1e10;  ///< stiffness of its surface; two surfaces in contact are springs in series

  bool can_be_touched() const { return !parts.empty(); }
};

/// Gap between two bodies, negative when they overlap; infinite when it is more than `limit_m`.
double distance_m(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB,
                  double limit_m) noexcept;

/// Whether the two overlap by more than `depth_m`.
bool overlaps(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB, double depth_m) noexcept;

}  // namespace tandem::physics
