// Builds the world of the local model from the join message and the scene's assets. Every number is checked before it
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

/// Contact shapes that are already built. The key is the serialised shape message without placement, with the hash of
/// the asset.
using ContactShapes = std::map<std::string, std::shared_ptr<const contact::ContactShape>>;

/// Builds the world of a LocalModel. A mesh without its full contact asset uses the coarse one if that has arrived.
///
/// In      joined  join message of a manipulator, accepted by fill_haptic_scene()
///         shapes  shapes of the previous world; equal shapes are reused
/// Out     shapes  shapes of this world
/// Fails   std::exception whose message names the unusable field or asset; the caller then displays the late pose
/// Cost    milliseconds for each distinct shape, tens of milliseconds for a mesh; a live client must not call it on its
///         io thread
std::shared_ptr<const physics::WorldDescription> make_local_world(const wire::Joined& joined, const AssetMap& assets,
                                                                  ContactShapes& shapes);

/// Checks that the machine can step this world at the haptic rate. Measures a few steps with every tool at its start.
///
/// Fails   std::runtime_error if the shortest step took longer than `most`: the machine cannot keep the haptic rate
void require_in_time(const std::shared_ptr<const physics::WorldDescription>& world, Duration most);

}  // namespace tandem::client
