// Scenes of tests, loaded from their text. Each scene is loaded only once per program; this is safe because loaded
// scenes are immutable. Preparing shapes for contact takes 0.1 s, and seconds with a sanitizer.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/assets/scene_file.hpp"

namespace tandem::test {

/// Returns the scene with this text.
/// Thread  any, one at a time
/// Fails   SceneError, like load_scene_text()
inline std::shared_ptr<const server::LoadedScene> scene_of(const std::string& json) {
  static std::map<std::string, std::shared_ptr<const server::LoadedScene>> loaded;
  std::shared_ptr<const server::LoadedScene>& scene = loaded[json];
  if (scene == nullptr) scene = server::load_scene_text(json, "test.json", ".");
  return scene;
}

}  // namespace tandem::test
