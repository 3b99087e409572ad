// Seals the datagrams of one direction of one connection, or opens them.
//
//   TLS connection ──exporter(connection id)──▶ secret ──HKDF──▶ up, down          one chain a direction, so that no two
//                                                  epoch 0: key, IV                counters ever share a key
//                                                  epoch 1: key, IV  …             each from the chain of the one before,
//                                                                                  which is then wiped
//   nonce = IV xor sequence · associated data = the header up to the tag · the tag is the end of the header
//
// The sequence goes on over epochs, so freshness and replay window do too. Without a secret (--insecure, virtual time)
// the same calls leave the payload as it is, and the tag is zero.
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

/// A key serves for so many datagrams, or so long; then the sender goes on to the next epoch.
inline constexpr std::uint64_t kMaxDatagramsPerEpoch = 1ULL << 32U;
inline constexpr Duration kMaxEpochAge = std::chrono::hours(1);

/// What a TLS connection exports for the datagrams of `connection`.
std::array<std::byte, 8> seal_context(ConnectionId connection);

/// Cost    no allocation but at construction and at a new epoch
/// Thread  any, one at a time
class DatagramSeal {
 public:
  enum class Use : std::uint8_t { kSeal, kOpen };

  /// In      exported  none: null cipher
  ///         goes_up   the datagrams go to the server
  ///         epoch     the first one
  DatagramSeal(const std::optional<secure::Exported>& exported, Use use, bool goes_up, std::uint8_t epoch);
  ~DatagramSeal();
  DatagramSeal(DatagramSeal&&) noexcept;
  DatagramSeal& operator=(DatagramSeal&&) noexcept;

  bool is_null() const { return keys_ == nullptr; }
  /// Of what is sealed next.
  std::uint8_t epoch() const { return epoch_; }
  /// Goes on to the next epoch when this one's key has served long enough. Before the header is written.
  void keep_fresh(LocalTime now);
  /// Encrypts what is behind the header, in place, and fills in the tag.
  void seal(std::uint64_t sequence, std::span<std::byte> datagram);
  /// Authenticates the datagram and gives its payload, which stays until the next call.
  ///
  /// Out     kTag: forged, damaged, or sealed with another key; kUnknownConnection: another epoch than this and the next
  DropReason open(const DatagramHeader& header, std::span<const std::byte> datagram,
                  std::span<const std::byte>& payload);

 private:
  struct Keys;
  void advance();
  DropReason open_null(const DatagramHeader& header, std::span<const std::byte> datagram) const;

  std::uint8_t epoch_;
  std::uint64_t sealed_ = 0;  ///< in this epoch
  LocalTime epoch_began_{};
  std::unique_ptr<Keys> keys_;  ///< null: null cipher
};

}  // namespace tandem::proto
