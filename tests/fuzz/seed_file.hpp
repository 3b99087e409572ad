// Seed files, which the corpus programs write and the fuzz targets read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <span>
#include <stdexcept>

namespace tandem::fuzz {

/// Writes FILE.seed with the raw bytes, for a fuzzer, and FILE.hex, for the runner.
inline void write_seed(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream raw(file.string() + ".seed", std::ios::binary), hex(file.string() + ".hex");
  raw.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  hex << std::hex << std::setfill('0');
  for (const std::byte byte : bytes) hex << std::setw(2) << std::to_integer<int>(byte);
  if (!raw.flush() || !hex.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

}  // namespace tandem::fuzz
