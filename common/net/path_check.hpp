// Whether an address is really where a peer's datagrams come from. A peer that is known can send with a false source
// address: until the address has said back a number that nobody can guess, it gets no more than kAmplification times
// what came from it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"

namespace tandem::net {

/// Thread  any, one at a time; no allocation
class PathCheck {
 public:
  /// As QUIC has it (RFC 9000 §8.1).
  static constexpr std::uint64_t kAmplification = 3;
  static constexpr Duration kAskAgain = std::chrono::milliseconds(20);

  PathCheck() = default;
  /// In      number  that the address is to say back; drawn so that it cannot be guessed
  explicit PathCheck(std::uint64_t number) : number_(number) {}

  bool is_valid() const { return is_valid_; }
  std::uint64_t number() const { return number_; }
  void note_received(std::size_t bytes) { received_ += bytes; }
  void note_answer(std::uint64_t number) { is_valid_ = is_valid_ || number == number_; }
  /// Without a question: the address is known otherwise.
  void trust() { is_valid_ = true; }
  /// Says whether so many bytes may go there, and counts them when they may.
  bool take(std::size_t bytes) {
    if (!is_valid_ && sent_ + bytes > kAmplification * received_) return false;
    sent_ += bytes;
    return true;
  }
  /// Says whether the number should be sent now; then not again for kAskAgain.
  bool is_due(LocalTime now) {
    if (is_valid_ || (asked_ != LocalTime{} && now - asked_ < kAskAgain)) return false;
    asked_ = now;
    return true;
  }

 private:
  std::uint64_t number_ = 0;
  std::uint64_t received_ = 0;
  std::uint64_t sent_ = 0;
  bool is_valid_ = false;
  LocalTime asked_{};
};

}  // namespace tandem::net
