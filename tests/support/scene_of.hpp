// Scenes of tests, from their text. Nobody changes a loaded scene, so each is loaded once in a program: shapes take a
// tenth of a second to be made ready for touch, and seconds under a sanitizer.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/assets/scene_file.hpp"

namespace tandem::test {

/// Thread  one at a time
/// Fails   as load_scene_text()
inline std::shared_ptr<const server::LoadedScene> scene_of(const std::string& json) {
  static std::map<std::string, std::shared_ptr<const server::LoadedScene>> loaded;
  std::shared_ptr<const server::LoadedScene>& scene = loaded[json];
  if (scene == nullptr) scene = server::load_scene_text(json, "test.json", ".");
  return scene;
}

}  // namespace tandem::test
