// Small whole numbers as few bytes, directions as two numbers, and bytes packed by zstd: how assets of meshes are kept and
// sent.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// One byte for −127 to 126, else three or five.
void put_number(std::vector<std::uint8_t>& bytes, std::int32_t value);
/// What put_number() wrote; 0, and not ok(), past the end.
std::int32_t take_number(ByteReader& reader);

/// Numbers of about one size: their lowest bytes, then the next, …
std::vector<std::uint8_t> planes_of(std::span<const std::int32_t> values);
std::vector<std::int32_t> values_of(std::span<const std::uint8_t> planes);

/// A direction as a place in a square, −1 to 1 each way: an octahedron, unfolded.
///
/// Source  Meyer et al., "On floating-point normal vectors", EGSR 2010
/// In      direction  of any length but 0
Eigen::Vector2d in_square(const Vec3& direction);
/// Of length 1.
Vec3 direction_of(double x, double y);

/// Appends a block: `raw`, packed where that makes it shorter.
///
/// In      packing_level  of zstd, 1 to 22; 0: it is left as it is
void append_block(std::vector<std::uint8_t>& bytes, std::span<const std::uint8_t> raw, int packing_level);
/// The next block as it was; none when it is damaged or longer than `limit_bytes`, which is all that it may allocate.
std::optional<std::vector<std::uint8_t>> read_block(ByteReader& reader, std::size_t limit_bytes);

}  // namespace tandem::geometry
