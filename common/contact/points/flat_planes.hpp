// Planes of a shape's flat parts, estimated from the points of its shell.
#pragma once

#include <vector>

#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

struct PointShell;

/// Planes of the largest flat parts of a surface, kMaxPlanes at most.
std::vector<FieldPlane> planes_of(const PointShell& surface);

}  // namespace tandem::contact
