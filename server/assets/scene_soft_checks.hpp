// Checks of the soft bodies of a scene that need no further file.
#pragma once

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxSoftBodies = 8;
/// Names of the bits of SoftSides, in their order.
inline constexpr const char* kSoftSideNames[] = {"-x", "+x", "-y", "+y", "-z", "+z"};

/// Fills in the defaults that the table of ranges (proto/scene_ranges.hpp) lacks: placements, and the node spacing of a
/// block (a cuboid soft body).
void complete_soft_bodies(wire::Scene& scene);
/// Refuses the first soft body that cannot be simulated: checks names, kinds and anchored sides.
/// In      scene  its numbers must be complete and within their ranges
/// Fails   SceneError
void check_soft_bodies(const wire::Scene& scene, const SceneField& file);

}  // namespace tandem::server
