// Compact encoding for mesh assets: variable-length integers, unit vectors as two numbers, and blocks compressed by
// zstd.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// Appends an integer: one byte for −127 to 126, otherwise three or five.
void append_number(std::vector<std::uint8_t>& bytes, std::int32_t value);
/// Reads an integer that append_number() wrote. Past the end it returns 0 and the reader is no longer ok().
std::int32_t pop_number(ByteReader& reader);

/// Splits integers of similar size into byte planes: all lowest bytes first, then the next higher ones, and so on.
std::vector<std::uint8_t> planes_of(std::span<const std::int32_t> values);
std::vector<std::int32_t> values_of(std::span<const std::uint8_t> planes);

/// Maps a direction to octahedral coordinates: a point in the square from −1 to 1.
///
/// Source  Meyer et al., "On floating-point normal vectors", EGSR 2010
/// In      direction  any length except 0
Eigen::Vector2d in_square(const Vec3& direction);
/// Returns the unit vector of octahedral coordinates.
Vec3 direction_of(double x, double y);

/// Appends `raw` as a block, compressed where that makes it shorter.
///
/// In      packing_level  compression level of zstd, 1 to 22; 0: uncompressed
void append_block(std::vector<std::uint8_t>& bytes, std::span<const std::uint8_t> raw, int packing_level);
/// Reads the next block and decompresses it. Returns none for a damaged block or one longer than `limit_bytes`, the
/// limit of its allocation.
std::optional<std::vector<std::uint8_t>> read_block(ByteReader& reader, std::size_t limit_bytes);

}  // namespace tandem::geometry
