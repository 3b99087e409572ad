// Files are named by what is in them: a client that has a file of the same hash need not fetch it again.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace tandem::proto {

using Sha256 = std::array<std::byte, 32>;

/// A hash as a message has it; none when it is not 32 bytes.
std::optional<Sha256> hash_from(const std::string& bytes);

/// 64 hexadecimal digits: a hash as a file name or a log has it.
std::string hex(const Sha256& hash);

/// SHA-256 of `bytes`. Fails: std::runtime_error when OpenSSL has no SHA-256 (a broken installation).
Sha256 sha256_of(std::span<const std::byte> bytes);

}  // namespace tandem::proto
