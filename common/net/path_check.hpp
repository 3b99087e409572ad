// Verifies the address from which a peer's datagrams come. An authenticated peer can send with a false source address.
// Until the address returns an unguessable number, it receives at most kAmplification times the bytes received from it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"

namespace tandem::net {

/// Verification of one address.
/// Thread  any, one at a time; no allocation
class PathCheck {
 public:
  /// Same limit as QUIC (RFC 9000 §8.1).
  static constexpr std::uint64_t kAmplification = 3;
  static constexpr Duration kRetryPeriod = std::chrono::milliseconds(20);

  PathCheck() = default;
  /// In      number  the address must return it; drawn so that it cannot be guessed
  explicit PathCheck(std::uint64_t number) : number_(number) {}

  bool is_valid() const { return is_valid_; }
  std::uint64_t number() const { return number_; }
  void note_received(std::size_t bytes) { received_ += bytes; }
  void note_answer(std::uint64_t number) { is_valid_ = is_valid_ || number == number_; }
  /// Accepts the address without a challenge: it is verified by other means.
  void trust() { is_valid_ = true; }
  /// Returns whether `bytes` may be sent to the address, and counts them if so.
  bool consume(std::size_t bytes) {
    if (!is_valid_ && sent_ + bytes > kAmplification * received_) return false;
    sent_ += bytes;
    return true;
  }
  /// Returns whether to send the number now; if so, not again for kRetryPeriod.
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
