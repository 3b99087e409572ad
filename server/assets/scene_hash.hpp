// Hash that identifies a scene in checkpoints and in the names of its folders.
#pragma once

#include "proto/content_hash.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::server {

/// Hash of the scene's description and the assets it names, except drawings.
proto::Sha256 hash_of(const LoadedScene& scene);

}  // namespace tandem::server
