#include "client/view/screen/scene_pictures.hpp"

#include <epoxy/gl.h>

#include <optional>

#include "client/view/png_file.hpp"

namespace tandem::client {
namespace {

std::uint32_t texture_of(const Pixels& picture) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, picture.width, picture.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
               picture.rgb.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace

ScenePictures::~ScenePictures() {
  for (const auto& [name, texture] : textures_) glDeleteTextures(1, &texture);
}

std::uint32_t ScenePictures::texture(std::string_view name) {
  if (const auto found = textures_.find(name); found != textures_.end()) return found->second;
  const std::optional<Pixels> picture = read_png(folder_ / (std::string(name) + ".png"));
  return textures_[std::string(name)] = picture ? texture_of(*picture) : 0;
}

}  // namespace tandem::client
