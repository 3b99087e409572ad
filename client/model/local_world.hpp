// What a client may know of the scene to touch it at once: made of what the server sent when the user joined, with the
// scene's assets, and every number checked before it can reach a hand.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/session/asset_store.hpp"
#include "common/base/time.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/physics/world_description.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// By what they were made of: a shape's message without its placement, with the hash of the asset that was there.
using ContactShapes = std::map<std::string, std::shared_ptr<const contact::ContactShape>>;

/// The world of a LocalModel. Of a mesh whose contact asset is not here, the coarse one if that is.
///
/// In      joined  of a manipulator, as fill_haptic_scene() accepts it
///         shapes  of the world that was made before: what is alike is not made again
/// Out     shapes  of this one
/// Fails   std::exception whose message names the field or asset that cannot be used; the hand is then shown the
///         late pose
/// Cost    milliseconds a shape of its own kind, tens of milliseconds a mesh: not for the io thread of a live client
std::shared_ptr<const physics::WorldDescription> make_local_world(const wire::Joined& joined, const AssetMap& assets,
                                                                  ContactShapes& shapes);

/// Takes some steps with every tool at its start.
///
/// Fails   std::runtime_error: the quickest took longer than `most`; this machine could not keep the haptic loop's rate
void require_in_time(const std::shared_ptr<const physics::WorldDescription>& world, Duration most);

}  // namespace tandem::client
