// What can be said about a scene's soft bodies without opening any other file.
#pragma once

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxSoftBodies = 8;
inline constexpr const char* kSoftSideNames[] = {"-x", "+x", "-y", "+y", "-z", "+z"};  ///< bits of SoftSides

/// Fills in what the table of ranges does not: placements, and the spacing of a block's nodes.
void complete_soft_bodies(wire::Scene& scene);
/// In      scene  its numbers are complete and in their ranges
/// Fails   SceneError
void check_soft_bodies(const wire::Scene& scene, const SceneField& file);

}  // namespace tandem::server
