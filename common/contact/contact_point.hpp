// One contact of a pair of shapes: output of the search, input of the solver.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"

namespace tandem::contact {

/// One place where A meets B.
struct ContactPoint {
  Vec3 p_W = Vec3::Zero();        ///< sample on the surface of the shape that owns the point
  Vec3 normal_W = Vec3::UnitZ();  ///< unit, out of B towards A: the force on A is along it
  double depth_m = 0;             ///< overlap along the normal; negative: a gap
  double area_m2 = 0;
  Vec3 bristle_W = Vec3::Zero();  ///< tangential displacement of A past B since they stuck; written by the solver
  /// Identity of the sample, the same from step to step: index of the point in its shell, or of the first of several
  /// merged points. kOtherDirection marks points of the shape with the larger surface. kClosedForm marks a part of a
  /// ball (numbered from its deepest point outwards) or of a rod (RodContacts), which has no sample.
  std::uint32_t id = 0;
  /// Number of shell points, from `id` on, that the contact represents; for a slice of a face, the points whose
  /// friction it inherits.
  std::uint32_t count = 1;

  static constexpr std::uint32_t kOtherDirection = 1U << 31;
  static constexpr std::uint32_t kClosedForm = 1U << 30;
};

}  // namespace tandem::contact
