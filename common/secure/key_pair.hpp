// Keys of servers, of issuers of join tokens, and of clients that resume a session.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include "common/secure/secret.hpp"

struct evp_pkey_st;

namespace tandem::secure {

/// Public key of the Ed25519 signature scheme.
using PublicKey = std::array<std::byte, 32>;
using Signature = std::array<std::byte, 64>;

/// A private key with its public key. All copies of an object share one key, which is wiped with the last copy.
///
/// Thread  any, one at a time
class KeyPair {
 public:
  enum class Kind : std::uint8_t { kEd25519, kP256 };

  /// Generates a new key.
  /// Fails   std::runtime_error: the operating system supplies no random bytes
  static KeyPair make(Kind kind);
  /// Reads a key from a PEM file.
  /// Fails   std::invalid_argument: the file cannot be read or contains no private key; the message names the file
  static KeyPair load(const std::filesystem::path& file);
  /// Reads a key from a file. If the file does not exist, generates a key and writes the file.
  /// Fails   std::invalid_argument, see load() and save()
  static KeyPair load_or_make(const std::filesystem::path& file, Kind kind);
  /// Writes the key as PEM, readable by its owner only (0600); creates the folder (0700) if necessary.
  /// Fails   std::invalid_argument: the file cannot be written
  void save(const std::filesystem::path& file) const;

  KeyId id() const;
  /// Returns the raw public key of an Ed25519 key.
  /// Fails   std::invalid_argument: the key is of another kind
  PublicKey public_key() const;
  Signature sign(std::span<const std::byte> message) const;

  evp_pkey_st* handle() const { return key_.get(); }

 private:
  explicit KeyPair(std::shared_ptr<evp_pkey_st> key) : key_(std::move(key)) {}
  std::shared_ptr<evp_pkey_st> key_;
};

/// Returns whether `signature` is a valid signature of the message by the Ed25519 key.
bool has_signed(const PublicKey& key, std::span<const std::byte> message, const Signature& signature);

/// Writes `text` to a new file, completely or not at all. If `is_private`, only the owner can read the file.
/// Fails   std::invalid_argument: the file cannot be written, or already exists
void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_private);

}  // namespace tandem::secure
