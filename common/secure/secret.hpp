// Secret bytes, random bytes, and text encoding of bytes that people paste.
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
/// SHA-256 of a public key (SubjectPublicKeyInfo, DER): names and pins a server's key.
using KeyId = std::array<std::byte, 32>;

/// Overwrites memory; no compiler optimises this away.
void wipe(std::span<std::byte> bytes) noexcept;
/// Compares in a time that does not depend on the position of a difference.
bool is_equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;
/// Fails   std::runtime_error: the system supplies none
void fill_random(std::span<std::byte> bytes);
std::uint64_t random_u64();

/// Base64 with - and _ (RFC 4648 §5), without padding.
std::string text_of(std::span<const std::byte> bytes);
/// Decodes text_of(); empty: invalid characters, or no whole number of bytes.
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
