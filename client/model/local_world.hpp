// What a client may know of the scene to touch it at once: made of what the server sent when the user joined, with the
// scene's assets, and every number checked before it can reach a hand.
#pragma once

#include <memory>
#include <string>

#include "client/session/asset_fetcher.hpp"
#include "common/physics/world_description.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// A world for a LocalModel, or why there is none.
struct LocalWorld {
  std::shared_ptr<const physics::WorldDescription> description;  ///< null: see `problem`
  std::size_t tool = 0;                                          ///< the user's own
  std::string problem;  ///< names the field or asset; the hand is then shown the late pose
};

/// In      joined  of a manipulator, as fill_haptic_scene() accepts it
/// Cost    milliseconds a shape of its own kind, tens of milliseconds a mesh: not for the io thread of a live client
LocalWorld make_local_world(const wire::Joined& joined, const AssetMap& assets);

}  // namespace tandem::client
