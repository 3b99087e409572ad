// Writes and reads PNG files, by libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace tandem::client {

/// In      rgb  width · height · 3 bytes, rows from top to bottom
/// Fails   std::runtime_error if the file cannot be written; the message names the file
void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgb, int width, int height);

struct Pixels {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< pixels in the layout of write_png()
};
inline constexpr std::uint32_t kMaxPngSide = 2048;
/// Reads a picture of at most kMaxPngSide pixels in width and height. Returns nothing if it is missing, larger or
/// damaged.
std::optional<Pixels> read_png(const std::filesystem::path& file);

}  // namespace tandem::client
