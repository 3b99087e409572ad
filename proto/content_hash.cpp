#include "proto/content_hash.hpp"

#include <openssl/evp.h>

#include <cstring>
#include <stdexcept>
#include <string_view>

namespace tandem::proto {

std::optional<Sha256> hash_from(const std::string& bytes) {
  Sha256 hash{};
  if (bytes.size() != hash.size()) return std::nullopt;
  std::memcpy(hash.data(), bytes.data(), hash.size());
  return hash;
}

std::string hex(const Sha256& hash) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : hash) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    text += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

Sha256 sha256_of(std::span<const std::byte> bytes) {
  Sha256 hash{};
  unsigned int length = 0;
  const int is_ok = EVP_Digest(bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(hash.data()), &length,
                               EVP_sha256(), nullptr);
  if (is_ok != 1 || length != hash.size()) throw std::runtime_error("OpenSSL cannot compute SHA-256");
  return hash;
}

}  // namespace tandem::proto
