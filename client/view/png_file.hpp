// Writes pictures as PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace tandem::client {

/// In      rgb  three bytes per pixel, in rows from top to bottom
/// Fails   std::runtime_error: the file cannot be written
void write_png(const std::filesystem::path& file, std::span<const std::uint8_t> rgb, int width, int height);

}  // namespace tandem::client
