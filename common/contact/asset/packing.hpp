// Small whole numbers as few bytes, and bytes packed by zstd: how contact assets are kept and sent. Private to them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/byte_io.hpp"

namespace tandem::contact {

/// One byte for −127 to 126, else three or five.
void put_number(std::vector<std::uint8_t>& bytes, std::int32_t value);
/// What put_number() wrote; 0, and not ok(), past the end.
std::int32_t take_number(ByteReader& reader);

/// Numbers of about one size: their lowest bytes, then the next, …
std::vector<std::uint8_t> planes_of(std::span<const std::int32_t> values);
std::vector<std::int32_t> values_of(std::span<const std::uint8_t> planes);

/// Appends a block: `raw`, packed where that makes it shorter.
///
/// In      packing_level  of zstd, 1 to 22; 0: it is left as it is
void append_block(std::vector<std::uint8_t>& bytes, std::span<const std::uint8_t> raw, int packing_level);
/// The next block as it was; none when it is damaged or longer than `limit_bytes`, which is all that it may allocate.
std::optional<std::vector<std::uint8_t>> read_block(ByteReader& reader, std::size_t limit_bytes);

}  // namespace tandem::contact
