#include "client/view/png_file.hpp"

#include <png.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace tandem::client {

void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgb, int width, int height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  if (rgb.size() < PNG_IMAGE_SIZE(image) ||
      png_image_write_to_file(&image, file.c_str(), 0, rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error("cannot write the picture " + file.string() + ": " + std::string(image.message));
  }
}

std::optional<Pixels> read_png(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return std::nullopt;
  image.format = PNG_FORMAT_RGB;
  Pixels pixels;
  if (image.width <= kMaxPngSide && image.height <= kMaxPngSide) {
    pixels = {static_cast<int>(image.width), static_cast<int>(image.height), {}};
    pixels.rgb.resize(PNG_IMAGE_SIZE(image));
  }
  const bool is_read =
      !pixels.rgb.empty() && png_image_finish_read(&image, nullptr, pixels.rgb.data(), 0, nullptr) != 0;
  png_image_free(&image);
  return is_read ? std::optional(std::move(pixels)) : std::nullopt;
}

}  // namespace tandem::client
