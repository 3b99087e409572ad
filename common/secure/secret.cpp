#include "common/secure/secret.hpp"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <bit>
#include <stdexcept>

namespace tandem::secure {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
constexpr unsigned kBitsPerLetter = 6;

}  // namespace

void wipe(std::span<std::byte> bytes) noexcept {
  OPENSSL_cleanse(bytes.data(), bytes.size());
}

bool is_equal(std::span<const std::byte> a, std::span<const std::byte> b) noexcept {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

void fill_random(std::span<std::byte> bytes) {
  if (RAND_bytes(reinterpret_cast<unsigned char*>(bytes.data()), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("the system provides no random bytes for keys and ids; check /dev/urandom");
  }
}

std::uint64_t random_u64() {
  std::array<std::byte, sizeof(std::uint64_t)> bytes{};
  fill_random(bytes);
  return std::bit_cast<std::uint64_t>(bytes);
}

std::string text_of(std::span<const std::byte> bytes) {
  std::string text;
  unsigned pending = 0, bits = 0;
  for (const std::byte byte : bytes) {
    pending = pending << 8U | std::to_integer<unsigned>(byte);
    for (bits += 8; bits >= kBitsPerLetter; bits -= kBitsPerLetter) {
      text += kLetters[pending >> (bits - kBitsPerLetter) & 63U];
    }
    pending &= (1U << bits) - 1;
  }
  if (bits > 0) text += kLetters[pending << (kBitsPerLetter - bits) & 63U];
  return text;
}

std::optional<Bytes> bytes_of_text(std::string_view text) {
  Bytes bytes;
  unsigned pending = 0, bits = 0;
  for (const char letter : text) {
    const std::size_t value = kLetters.find(letter);
    if (value == std::string_view::npos) return std::nullopt;
    pending = pending << kBitsPerLetter | static_cast<unsigned>(value);
    bits += kBitsPerLetter;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<std::byte>(pending >> bits & 0xFFU));
    pending &= (1U << bits) - 1;
  }
  // The text must not end with an incomplete byte: the bits that remain must be zero and fewer than a letter's bits.
  // Each byte string then has exactly one encoding.
  if (bits >= kBitsPerLetter || pending != 0) return std::nullopt;
  return bytes;
}

}  // namespace tandem::secure
