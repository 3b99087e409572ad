// Keys of servers, of issuers of join tokens, and of clients that rejoin.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include "common/secure/secret.hpp"

struct evp_pkey_st;

namespace tandem::secure {

/// Key of an Ed25519 signature.
using PublicKey = std::array<std::byte, 32>;
using Signature = std::array<std::byte, 64>;

/// A private key with its public key. Copies share it; the last copy wipes it.
///
/// Thread  any, one at a time
class KeyPair {
 public:
  enum class Kind : std::uint8_t { kEd25519, kP256 };

  /// Generates a key.
  /// Fails   std::runtime_error: the system supplies no random bytes
  static KeyPair make(Kind kind);
  /// Reads a key from a PEM file.
  /// Fails   std::invalid_argument: the file cannot be read or contains no private key; the message names the file
  static KeyPair load(const std::filesystem::path& file);
  /// Reads a key; generates the key and the file if there is none.
  /// Fails   std::invalid_argument, see load() and save()
  static KeyPair load_or_make(const std::filesystem::path& file, Kind kind);
  /// Writes PEM, readable by its owner only (0600); creates the folder (0700).
  /// Fails   std::invalid_argument: the file cannot be written
  void save(const std::filesystem::path& file) const;

  KeyId id() const;
  /// The raw public key; Ed25519 only.
  /// Fails   std::invalid_argument: a key of another kind
  PublicKey public_key() const;
  Signature sign(std::span<const std::byte> message) const;

  evp_pkey_st* handle() const { return key_.get(); }

 private:
  explicit KeyPair(std::shared_ptr<evp_pkey_st> key) : key_(std::move(key)) {}
  std::shared_ptr<evp_pkey_st> key_;
};

/// Returns whether the Ed25519 key has signed the message.
bool has_signed(const PublicKey& key, std::span<const std::byte> message, const Signature& signature);

/// Writes `text` to a file as a whole or not at all. Only its owner can read it if `is_private`.
/// Fails   std::invalid_argument: the file cannot be written, or exists already
void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_private);

}  // namespace tandem::secure
