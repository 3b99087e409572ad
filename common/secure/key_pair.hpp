// Keys of servers, of who issues join tokens, and of a client that comes back.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include "common/secure/secret.hpp"

struct evp_pkey_st;

namespace tandem::secure {

/// Ed25519.
using PublicKey = std::array<std::byte, 32>;
using Signature = std::array<std::byte, 64>;

/// A private key with its public one; copies share it, and the last one wipes it.
///
/// Thread  any, one at a time
class KeyPair {
 public:
  enum class Kind : std::uint8_t { kEd25519, kP256 };

  /// Fails   std::runtime_error: the system gives no random bytes
  static KeyPair make(Kind kind);
  /// From a PEM file.
  /// Fails   std::invalid_argument: it cannot be read, or holds no private key; the message names it
  static KeyPair load(const std::filesystem::path& file);
  /// Makes key and file where there is none.
  /// Fails   std::invalid_argument as load() and save()
  static KeyPair load_or_make(const std::filesystem::path& file, Kind kind);
  /// As PEM, readable by its owner only (0600); makes the folder (0700).
  /// Fails   std::invalid_argument: it cannot be written
  void save(const std::filesystem::path& file) const;

  KeyId id() const;
  /// Ed25519 only.
  /// Fails   std::invalid_argument: a key of another kind
  PublicKey public_key() const;
  Signature sign(std::span<const std::byte> message) const;

  evp_pkey_st* handle() const { return key_.get(); }

 private:
  explicit KeyPair(std::shared_ptr<evp_pkey_st> key) : key_(std::move(key)) {}
  std::shared_ptr<evp_pkey_st> key_;
};

/// Whether the Ed25519 key has signed the message.
bool has_signed(const PublicKey& key, std::span<const std::byte> message, const Signature& signature);

/// Writes `text` to a file that only its owner can read when `is_private`; whole or not at all.
/// Fails   std::invalid_argument: it cannot be written, or is there already
void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_private);

}  // namespace tandem::secure
