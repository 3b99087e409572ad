// Encrypts or decrypts the datagrams of one direction of one connection.
//
//   TLS connection ──exporter(connection id)──▶ secret ──HKDF──▶ up, down          one chain per direction, so that no
//                                                  epoch 0: key, IV                two counters ever share a key
//                                                  epoch 1: key, IV  …             each derived from the previous
//                                                                                  chain, which is then wiped
//   nonce = IV xor sequence · associated data = the header up to the tag · the tag is the end of the header
//
// The sequence number, the freshness check and the replay window do not restart at a new epoch. Without a secret
// (--insecure, virtual time), the null cipher is used: the payload stays unchanged, and the tag is zero.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "common/base/time.hpp"
#include "common/secure/tls.hpp"
#include "proto/datagram.hpp"

namespace tandem::proto {

/// Limits for the use of one key: number of datagrams, and time. When one of them is reached, the sender changes to the
/// next epoch.
inline constexpr std::uint64_t kMaxDatagramsPerEpoch = 1ULL << 32U;
inline constexpr Duration kMaxEpochAge = std::chrono::hours(1);

/// Returns the context value with which the TLS exporter derives the secret for the datagrams of `connection`.
std::array<std::byte, 8> seal_context(ConnectionId connection);

/// Encrypts or decrypts the datagrams of one direction, with a new key for each epoch.
///
/// Cost    no allocation except at construction and at the change to a new epoch
/// Thread  any, one at a time
class DatagramSeal {
 public:
  enum class Use : std::uint8_t { kSeal, kOpen };

  /// In      exported  key material; empty: null cipher (no encryption)
  ///         goes_up   direction of the datagrams; true: from client to server
  ///         epoch     number of the first epoch
  DatagramSeal(const std::optional<secure::Exported>& exported, Use use, bool goes_up, std::uint8_t epoch);
  ~DatagramSeal();
  DatagramSeal(DatagramSeal&&) noexcept;
  DatagramSeal& operator=(DatagramSeal&&) noexcept;

  bool is_null() const { return keys_ == nullptr; }
  /// Returns the epoch of the next encrypted datagram.
  std::uint8_t epoch() const { return epoch_; }
  /// Changes to the next epoch if the current key has reached a limit. Call it before the header is written, because
  /// the header contains the epoch.
  void keep_fresh(LocalTime now);
  /// Encrypts the payload in place and writes the tag.
  void seal(std::uint64_t sequence, std::span<std::byte> datagram);
  /// Authenticates and decrypts a datagram. The payload remains valid until the next call.
  ///
  /// Out     kNone, or the reason to drop the datagram. kTag: it is forged, damaged or encrypted with a different key.
  ///         kUnknownConnection: its epoch is neither the current nor the next one
  DropReason open(const DatagramHeader& header, std::span<const std::byte> datagram,
                  std::span<const std::byte>& payload);

 private:
  struct Keys;
  void advance();
  DropReason open_null(const DatagramHeader& header, std::span<const std::byte> datagram) const;

  std::uint8_t epoch_;
  std::uint64_t sealed_ = 0;  ///< number of datagrams encrypted in the current epoch
  LocalTime epoch_began_{};
  std::unique_ptr<Keys> keys_;  ///< keys of the current and the next epoch; null: null cipher
};

}  // namespace tandem::proto
