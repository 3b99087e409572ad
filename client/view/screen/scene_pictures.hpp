// Small pictures of the shipped scenes, as textures. deploy/pictures makes them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace tandem::client {

/// Thread  the thread whose OpenGL context is current, also for the destruction
class ScenePictures {
 public:
  /// In      folder  files NAME.png
  explicit ScenePictures(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~ScenePictures();
  ScenePictures(const ScenePictures&) = delete;
  ScenePictures& operator=(const ScenePictures&) = delete;

  /// Texture of the picture; 0 if there is none. It is read at the first call.
  std::uint32_t texture(std::string_view name);

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::uint32_t, std::less<>> textures_;
};

}  // namespace tandem::client
