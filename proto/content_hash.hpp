// Hash of the content of a file, which identifies the file. A client need not download a file with a hash that the
// client already has.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace tandem::proto {

using Sha256 = std::array<std::byte, 32>;

/// Returns the hash that a message field contains; nothing if the field is not 32 bytes long.
std::optional<Sha256> hash_from(const std::string& bytes);

/// Returns the hash as 64 hexadecimal digits, the form used in file names and logs.
std::string hex(const Sha256& hash);

/// Returns the SHA-256 of `bytes`.
/// Fails   std::runtime_error: OpenSSL provides no SHA-256 (a broken installation)
Sha256 sha256_of(std::span<const std::byte> bytes);

}  // namespace tandem::proto
