#include "common/geometry/packing.hpp"

#include <zstd.h>

#include <cmath>

namespace tandem::geometry {
namespace {

// First bytes that announce an integer of two or of four further bytes. Any other first byte is the integer itself.
constexpr std::uint8_t kTwoBytes = 254;
constexpr std::uint8_t kFourBytes = 255;

std::vector<std::uint8_t> packed(std::span<const std::uint8_t> raw, int level) {
  if (level <= 0 || raw.empty()) return {};
  std::vector<std::uint8_t> bytes(ZSTD_compressBound(raw.size()));
  const std::size_t size = ZSTD_compress(bytes.data(), bytes.size(), raw.data(), raw.size(), level);
  bytes.resize(ZSTD_isError(size) != 0 ? 0 : size);
  return bytes;
}

/// Zigzag encoding: maps 0, −1, 1, −2, … to 0, 1, 2, 3, …
std::uint32_t folded_of(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1U) ^ static_cast<std::uint32_t>(value >> 31);
}

std::int32_t unfolded(std::uint32_t folded) {
  return static_cast<std::int32_t>(folded >> 1U) ^ -static_cast<std::int32_t>(folded & 1U);
}

double sign_of(double value) {
  return value < 0 ? -1 : 1;
}

}  // namespace

Eigen::Vector2d in_square(const Vec3& direction) {
  const Vec3 on = direction / direction.cwiseAbs().sum();
  if (on.z() >= 0) return {on.x(), on.y()};
  return {(1 - std::abs(on.y())) * sign_of(on.x()), (1 - std::abs(on.x())) * sign_of(on.y())};
}

Vec3 direction_of(double x, double y) {
  const double z = 1 - std::abs(x) - std::abs(y);
  if (z >= 0) return Vec3(x, y, z).normalized();
  return Vec3((1 - std::abs(y)) * sign_of(x), (1 - std::abs(x)) * sign_of(y), z).normalized();
}

void append_number(std::vector<std::uint8_t>& bytes, std::int32_t value) {
  const std::uint32_t folded = folded_of(value);
  ByteWriter writer(bytes);
  if (folded < kTwoBytes) {
    writer.number(static_cast<std::uint8_t>(folded));
  } else if (folded <= 0xFFFF) {
    writer.number(kTwoBytes);
    writer.number(static_cast<std::uint16_t>(folded));
  } else {
    writer.number(kFourBytes);
    writer.u32(folded);
  }
}

std::int32_t pop_number(ByteReader& reader) {
  std::uint32_t folded = reader.number<std::uint8_t>();
  if (folded == kTwoBytes) {
    folded = reader.number<std::uint16_t>();
  } else if (folded == kFourBytes) {
    folded = reader.u32();
  }
  return unfolded(folded);
}

std::vector<std::uint8_t> planes_of(std::span<const std::int32_t> values) {
  std::vector<std::uint8_t> planes;
  planes.reserve(4 * values.size());
  for (unsigned shift = 0; shift < 32; shift += 8) {
    for (const std::int32_t value : values) planes.push_back(static_cast<std::uint8_t>(folded_of(value) >> shift));
  }
  return planes;
}

std::vector<std::int32_t> values_of(std::span<const std::uint8_t> planes) {
  std::vector<std::int32_t> values(planes.size() / 4);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::uint32_t folded = 0;
    for (unsigned plane = 0; plane < 4; ++plane)
      folded |= std::uint32_t{planes[plane * values.size() + i]} << 8U * plane;
    values[i] = unfolded(folded);
  }
  return values;
}

void append_block(std::vector<std::uint8_t>& bytes, std::span<const std::uint8_t> raw, int packing_level) {
  const std::vector<std::uint8_t> shorter = packed(raw, packing_level);
  const bool is_packed = !shorter.empty() && shorter.size() < raw.size();
  const std::span<const std::uint8_t> kept = is_packed ? std::span<const std::uint8_t>(shorter) : raw;
  ByteWriter writer(bytes);
  writer.u32(static_cast<std::uint32_t>(raw.size()));
  writer.u32(static_cast<std::uint32_t>(kept.size()));
  writer.array(kept);
}

std::optional<std::vector<std::uint8_t>> read_block(ByteReader& reader, std::size_t limit_bytes) {
  const std::size_t raw_size = reader.u32();
  std::vector<std::uint8_t> kept(reader.count(1));
  reader.array(std::span(kept));
  if (!reader.ok() || kept.size() > raw_size || raw_size > limit_bytes) return std::nullopt;
  if (kept.size() == raw_size) return kept;
  std::vector<std::uint8_t> raw(raw_size);
  if (ZSTD_decompress(raw.data(), raw.size(), kept.data(), kept.size()) != raw_size) return std::nullopt;
  return raw;
}

}  // namespace tandem::geometry
