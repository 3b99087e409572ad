// What can be said about a scene's soft bodies without opening any other file.
#pragma once

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

inline constexpr std::size_t kMaxSoftBodies = 8;
inline constexpr const char* kSoftSideNames[] = {"-x", "+x", "-y", "+y", "-z", "+z"};  ///< bits of SoftSides

/// Fills in every default of the soft bodies and their rate, and refuses the first field that cannot be.
///
/// In      scene  its step_rate_hz is complete
/// Fails   SceneError
void complete_soft_bodies(wire::Scene& scene, const SceneField& file);

}  // namespace tandem::server
