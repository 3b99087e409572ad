// Reasons for which a received or sent state is dropped before it is used. Every drop is counted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tandem::proto {

enum class DropReason : std::uint8_t {
  kNone = 0,
  kTooShort,           ///< shorter than the header of a datagram
  kTooLong,            ///< longer than kMaxDatagramBytes
  kVersion,            ///< the protocol version differs from that of this program
  kType,               ///< this end does not receive datagrams of this type
  kTag,                ///< authentication failed (with the null cipher: the tag is not zero)
  kUnknownConnection,  ///< there is no connection with this id and epoch
  kLate,               ///< the state is older than the newest received one
  kDuplicate,          ///< the sequence number or the step was already received
  kSequenceJump,       ///< the sequence number is further ahead than kMaxSequenceJump
  kMalformed,          ///< no valid message, a required part is missing, or there are too many items
  kNotFinite,          ///< a number is NaN, infinite or out of range, or time stamps are in the wrong order
  kOverwritten,        ///< replaced by a newer state before it was sent or read
  kSendFailed,         ///< the socket did not accept the datagram
  kSimulatedLoss,      ///< dropped by the simulated link
  kNotAllowed,         ///< input from an observer, or a datagram from an address that is not the user's
  kCount,
};

/// Returns the name used in logs, JSON and metrics: "too_short", …
std::string_view name_of(DropReason reason);

/// Counts drops, with one counter for each reason.
class DropCounters {
 public:
  void add(DropReason reason, std::uint64_t n = 1) { counts_[static_cast<std::size_t>(reason)] += n; }
  std::uint64_t count(DropReason reason) const { return counts_[static_cast<std::size_t>(reason)]; }

 private:
  std::array<std::uint64_t, static_cast<std::size_t>(DropReason::kCount)> counts_{};
};

}  // namespace tandem::proto
