// Bytes that nobody else may learn, random bytes, and text for bytes that people paste.
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
/// SHA-256 of a public key (SubjectPublicKeyInfo, DER): how a server's key is named and pinned.
using KeyId = std::array<std::byte, 32>;

/// Overwrites in a way that no compiler leaves out.
void wipe(std::span<std::byte> bytes) noexcept;
/// In a time that does not depend on where they differ.
bool is_equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept;
/// Fails   std::runtime_error: the system gives none
void fill_random(std::span<std::byte> bytes);
std::uint64_t random_u64();

/// Base64 with - and _ (RFC 4648 §5), without padding.
std::string text_of(std::span<const std::byte> bytes);
/// Nothing: it has other characters, or is no whole number of bytes.
std::optional<Bytes> bytes_of_text(std::string_view text);

/// 32 bytes that are wiped when they go.
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
