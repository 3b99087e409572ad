// Loads small pictures of the installed scenes as textures. The program deploy/pictures creates the pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace tandem::client {

/// Textures of the pictures, loaded on demand.
///
/// Thread  the thread whose OpenGL context is current; this includes the destruction
class ScenePictures {
 public:
  /// In      folder  folder with the pictures, each in a file NAME.png
  explicit ScenePictures(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~ScenePictures();
  ScenePictures(const ScenePictures&) = delete;
  ScenePictures& operator=(const ScenePictures&) = delete;

  /// Returns the OpenGL texture of a picture; 0 if the picture does not exist. The file is read at the first call.
  std::uint32_t texture(std::string_view name);

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::uint32_t, std::less<>> textures_;
};

}  // namespace tandem::client
