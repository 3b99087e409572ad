// Names of files by their content: a client that has a file with the same hash need not fetch it again.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace tandem::proto {

using Sha256 = std::array<std::byte, 32>;

/// Returns the hash in a message; none when it is not 32 bytes.
std::optional<Sha256> hash_from(const std::string& bytes);

/// Returns 64 hexadecimal digits, the form of a hash in file names and logs.
std::string hex(const Sha256& hash);

/// Returns the SHA-256 of `bytes`. Fails: std::runtime_error when OpenSSL has no SHA-256 (a broken installation).
Sha256 sha256_of(std::span<const std::byte> bytes);

}  // namespace tandem::proto
