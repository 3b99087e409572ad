// Builds the world of the local model from the join message and the scene's assets. Every number is validated before it
// can affect the force.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/exchange/asset_map.hpp"
#include "common/base/time.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/physics/world_description.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Contact shapes that are already built, indexed by the serialised message of the shape. In this message the placement
/// is omitted, and the asset hash is that of the asset from which the shape was built (full or coarse).
using ContactShapes = std::map<std::string, std::shared_ptr<const contact::ContactShape>>;

/// Builds the world of a LocalModel. For a mesh whose full contact asset is missing, the coarse asset is used if it has
/// arrived.
///
/// In      joined  join message of a user with a tool; fill_haptic_scene() must have accepted the message
///         shapes  in: shapes of the previous world, which are reused where equal; out: shapes of the new world
/// Fails   std::exception if a field or asset is unusable; the message names it. The caller then displays "late-pose"
/// Cost    milliseconds for each distinct shape, tens of milliseconds for a mesh; a live client must not call it on its
///         io thread
std::shared_ptr<const physics::WorldDescription> make_local_world(const wire::Joined& joined, const AssetMap& assets,
                                                                  ContactShapes& shapes);

/// Checks that this machine can step the world at the haptic rate. Measures a few steps with every tool at its start
/// pose.
///
/// Fails   std::runtime_error if the shortest measured step took longer than `most`
void require_in_time(const std::shared_ptr<const physics::WorldDescription>& world, Duration most);

}  // namespace tandem::client
