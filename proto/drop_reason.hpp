// Reasons why a piece of state did not reach its reader. Each drop is counted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tandem::proto {

enum class DropReason : std::uint8_t {
  kNone = 0,
  kTooShort,           ///< shorter than a header
  kTooLong,            ///< longer than kMaxDatagramBytes
  kVersion,            ///< another protocol version
  kType,               ///< a type that this side does not receive
  kTag,                ///< authentication failed, or another epoch (null cipher: tag not zero)
  kUnknownConnection,  ///< no connection with that id and epoch
  kLate,               ///< older than the newest state
  kDuplicate,          ///< the same sequence again
  kSequenceJump,       ///< impossibly far ahead
  kMalformed,          ///< not a message, or over a count limit
  kNotFinite,          ///< a number is NaN, infinite or outside its stated range
  kOverwritten,        ///< replaced by a newer state before it was sent or read
  kSendFailed,         ///< refused by the socket
  kSimulatedLoss,      ///< lost by the simulated link
  kNotAllowed,         ///< from an observer, or from an address that is not the user's
  kCount,
};

/// Returns the word used in logs, JSON and metrics: "too_short", …
std::string_view name_of(DropReason reason);

/// One counter for each reason.
class DropCounters {
 public:
  void add(DropReason reason, std::uint64_t n = 1) { counts_[static_cast<std::size_t>(reason)] += n; }
  std::uint64_t count(DropReason reason) const { return counts_[static_cast<std::size_t>(reason)]; }

 private:
  std::array<std::uint64_t, static_cast<std::size_t>(DropReason::kCount)> counts_{};
};

}  // namespace tandem::proto
