// Builds the client's copy of the scene from the join message and the scene's assets. Every number is checked before it
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

/// Contact shapes by their source: the shape's message without placement, with the hash of the asset used.
using ContactShapes = std::map<std::string, std::shared_ptr<const contact::ContactShape>>;

/// Builds the world of a LocalModel. A mesh without its full contact asset uses the coarse one if that has arrived.
///
/// In      joined  a manipulator's message, accepted by fill_haptic_scene()
///         shapes  of the previous world: equal shapes are reused
/// Out     shapes  of this world
/// Fails   std::exception whose message names the unusable field or asset; the late pose is then displayed
/// Cost    milliseconds for each distinct shape, tens of milliseconds for a mesh: not for the io thread of a live
///         client
std::shared_ptr<const physics::WorldDescription> make_local_world(const wire::Joined& joined, const AssetMap& assets,
                                                                  ContactShapes& shapes);

/// Times some steps with every tool at its start.
///
/// Fails   std::runtime_error: the quickest took longer than `most`, so this machine cannot keep the haptic rate
void require_in_time(const std::shared_ptr<const physics::WorldDescription>& world, Duration most);

}  // namespace tandem::client
