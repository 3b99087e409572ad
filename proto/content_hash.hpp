// Identifies files by a hash of their content. A client that has a file with the same hash need not download it again.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace tandem::proto {

using Sha256 = std::array<std::byte, 32>;

/// Returns the hash stored in a message field; nothing if the field does not have 32 bytes.
std::optional<Sha256> hash_from(const std::string& bytes);

/// Returns 64 hexadecimal digits, the form of a hash in file names and logs.
std::string hex(const Sha256& hash);

/// Returns the SHA-256 of `bytes`.
/// Fails   std::runtime_error: OpenSSL provides no SHA-256 (a broken installation)
Sha256 sha256_of(std::span<const std::byte> bytes);

}  // namespace tandem::proto
