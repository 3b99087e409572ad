#include "server/assets/scene_hash.hpp"

namespace tandem::server {

proto::Sha256 hash_of(const LoadedScene& scene) {
  std::string text = scene.description.SerializeAsString();
  for (const Asset& asset : scene.assets) {
    if (asset.kind == "drawing") continue;
    text.append(reinterpret_cast<const char*>(asset.sha256.data()), asset.sha256.size());
  }
  return proto::sha256_of(std::as_bytes(std::span(text)));
}

}  // namespace tandem::server
