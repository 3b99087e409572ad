// Contact geometry of a body: the shapes in which the contact search finds contacts.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/contact_shape.hpp"

namespace tandem::physics {

/// Shapes and surface stiffness of a body. They do not change while a scene runs.
struct TouchModel {
  struct Part {
    std::shared_ptr<const contact::ContactShape> shape;
    Pose X_BS;
  };
  std::vector<Part> parts;  ///< empty for a body that cannot be touched, such as a molecule
  double radius_m = 0;      ///< radius of the sphere about the body's origin that contains all parts
  /// Stiffness of the surface: pressure per depth. Two surfaces in contact act as springs in series.
  double stiffness_n_per_m3 = 1e10;

  bool can_be_touched() const { return !parts.empty(); }
};

/// Returns the gap between two bodies, which is negative if they overlap; infinite if it exceeds `limit_m`.
double distance_m(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB,
                  double limit_m) noexcept;

/// Returns whether the two bodies overlap by more than `depth_m`.
bool overlaps(const TouchModel& a, const Pose& X_WA, const TouchModel& b, const Pose& X_WB, double depth_m) noexcept;

}  // namespace tandem::physics
