// Compact encodings for mesh assets: integers of variable length, unit vectors as two numbers, and blocks compressed by
// zstd.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// Appends an integer: one byte for values from −127 to 126, otherwise three or five bytes.
void append_number(std::vector<std::uint8_t>& bytes, std::int32_t value);
/// Reads an integer written by append_number(). A read past the end returns 0 and makes the reader's ok() false.
std::int32_t pop_number(ByteReader& reader);

/// Splits integers into byte planes: all lowest bytes first, then all second bytes, and so on. Planes of similar
/// integers compress better than the integers themselves.
std::vector<std::uint8_t> planes_of(std::span<const std::int32_t> values);
std::vector<std::int32_t> values_of(std::span<const std::uint8_t> planes);

/// Maps a direction to octahedral coordinates: a point in the square with coordinates from −1 to 1.
///
/// Source  Meyer et al., "On floating-point normal vectors", EGSR 2010
/// In      direction  vector of any length except 0
Eigen::Vector2d in_square(const Vec3& direction);
/// Inverse of in_square(): returns the unit vector for octahedral coordinates.
Vec3 direction_of(double x, double y);

/// Appends `raw` as a block. The block is compressed if that makes it shorter.
///
/// In      packing_level  compression level of zstd, 1 to 22; 0: not compressed
void append_block(std::vector<std::uint8_t>& bytes, std::span<const std::uint8_t> raw, int packing_level);
/// Reads and decompresses the next block. Returns nothing if the block is damaged or longer than `limit_bytes`. The
/// limit also bounds the allocated memory.
std::optional<std::vector<std::uint8_t>> read_block(ByteReader& reader, std::size_t limit_bytes);

}  // namespace tandem::geometry
