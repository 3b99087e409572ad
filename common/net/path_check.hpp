// Verifies the source address of a peer's datagrams, because even an authenticated peer can send with a false source
// address. Method: a random number is sent to the address. Until the peer returns this number, at most kAmplification
// times as many bytes are sent to the address as were received from it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"

namespace tandem::net {

/// Verification of one address: its state, and the numbers of bytes received from and sent to the address.
/// Thread  any, one at a time; no allocation
class PathCheck {
 public:
  /// Maximum ratio of sent to received bytes before verification; the same limit as in QUIC (RFC 9000 §8.1).
  static constexpr std::uint64_t kAmplification = 3;
  static constexpr Duration kRetryPeriod = std::chrono::milliseconds(20);

  PathCheck() = default;
  /// In      number  random, unguessable number that the peer must return
  explicit PathCheck(std::uint64_t number) : number_(number) {}

  bool is_valid() const { return is_valid_; }
  std::uint64_t number() const { return number_; }
  void note_received(std::size_t bytes) { received_ += bytes; }
  void note_answer(std::uint64_t number) { is_valid_ = is_valid_ || number == number_; }
  /// Accepts the address without a challenge, because it was verified by other means.
  void trust() { is_valid_ = true; }
  /// Returns whether `bytes` may be sent to the address. If so, counts them as sent.
  bool consume(std::size_t bytes) {
    if (!is_valid_ && sent_ + bytes > kAmplification * received_) return false;
    sent_ += bytes;
    return true;
  }
  /// Returns whether the random number must be sent to the peer now. The result is true at most once per kRetryPeriod.
  bool is_due(LocalTime now) {
    if (is_valid_ || (sent_at_ != LocalTime{} && now - sent_at_ < kRetryPeriod)) return false;
    sent_at_ = now;
    return true;
  }

 private:
  std::uint64_t number_ = 0;
  std::uint64_t received_ = 0;
  std::uint64_t sent_ = 0;
  bool is_valid_ = false;
  LocalTime sent_at_{};
};

}  // namespace tandem::net
