// Checks of the soft bodies of a scene that need no other file.
#pragma once

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxSoftBodies = 8;
inline constexpr const char* kSoftSideNames[] = {"-x", "+x", "-y", "+y", "-z", "+z"};  ///< bits of SoftSides

/// Fills in the defaults that are not in the table of ranges: placements, and the node spacing of a block.
void complete_soft_bodies(wire::Scene& scene);
/// In      scene  its numbers are filled in and within their ranges
/// Fails   SceneError
void check_soft_bodies(const wire::Scene& scene, const SceneField& file);

}  // namespace tandem::server
