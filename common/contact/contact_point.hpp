// One contact of a pair of shapes: output of the search, input of the solver.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"

namespace tandem::contact {

/// One point of contact between shapes A and B, or a point with a small gap between them.
struct ContactPoint {
  Vec3 p_W = Vec3::Zero();        ///< position of the sample on the surface of its shape
  Vec3 normal_W = Vec3::UnitZ();  ///< unit vector out of B towards A: direction of the normal force on A
  double depth_m = 0;             ///< overlap along the normal; negative: a gap
  double area_m2 = 0;
  /// State of friction: tangential displacement of A relative to B since the contact began to stick. The solver updates
  /// it.
  Vec3 bristle_W = Vec3::Zero();
  /// Identity of the contact, constant from step to step:
  /// * Contact of one shell point: the index of the point.
  /// * Contact of several points: the index of the first one.
  /// * With the bit kOtherDirection: the points belong to the shape that is searched second, usually the one with the
  ///   larger surface.
  /// * With the bit kClosedForm: the contact has no shell points. It is a part of a ball, numbered from the deepest
  ///   point outwards, or of a rod (RodContacts).
  std::uint32_t id = 0;
  /// Number of consecutive shell points, beginning with `id`, that the contact represents. A slice of a face inherits
  /// the friction of these points.
  std::uint32_t count = 1;

  static constexpr std::uint32_t kOtherDirection = 1U << 31;
  static constexpr std::uint32_t kClosedForm = 1U << 30;
};

}  // namespace tandem::contact
