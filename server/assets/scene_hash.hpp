// Hash that identifies a scene in checkpoints and in the names of folders for saved poses.
#pragma once

#include "proto/content_hash.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::server {

/// Returns the hash of the scene's description and of all assets that the scene names, except drawings.
proto::Sha256 hash_of(const LoadedScene& scene);

}  // namespace tandem::server
