// Secret bytes, random bytes, and a text encoding for bytes that people copy and paste.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::secure {

using Bytes = std::vector<std::byte>;
/// SHA-256 of a public key (SubjectPublicKeyInfo, DER). Clients identify a server by this value (key pinning).
using KeyId = std::array<std::byte, 32>;

/// Overwrites memory with zeros in a way that the compiler cannot optimise away.
void wipe(std::span<std::byte> bytes) noexcept;
/// Compares two byte strings. The duration does not depend on the position of the first difference, so an attacker
/// learns nothing from it.
bool is_equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;
/// Fills `bytes` with random bytes for cryptographic use.
/// Fails   std::runtime_error: the operating system supplies no random bytes
void fill_random(std::span<std::byte> bytes);
std::uint64_t random_u64();

/// Returns the bytes as URL-safe Base64 (with - and _, RFC 4648 §5), without padding.
std::string text_of(std::span<const std::byte> bytes);
/// Inverse of text_of(). Returns nothing if the text has invalid characters or does not encode a whole number of bytes.
std::optional<Bytes> bytes_of_text(std::string_view text);

/// A key of 32 bytes, wiped on destruction.
class Secret {
 public:
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { wipe(bytes_); }

  std::span<std::byte> bytes() { return bytes_; }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::array<std::byte, 32> bytes_{};
};

}  // namespace tandem::secure
