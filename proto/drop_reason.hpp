// Why a piece of state did not reach its reader. Each is counted; none is silent.
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
  kType,               ///< not a type that this side receives
  kTag,                ///< authentication failed, or another epoch (null cipher: tag not zero)
  kUnknownConnection,  ///< no connection of that id and epoch
  kLate,               ///< older than what is already here
  kDuplicate,          ///< the same sequence again
  kSequenceJump,       ///< impossibly far ahead
  kMalformed,          ///< not a message, or over a count limit
  kNotFinite,          ///< a number is NaN, infinite or outside its stated range
  kOverwritten,        ///< a newer state came before this one was sent or read
  kSendFailed,         ///< the socket would not take it
  kSimulatedLoss,      ///< lost by the simulated link
  kNotAllowed,         ///< from an observer, or from an address that is not the user's
  kCount,
};

/// "too_short", …: the word used in logs, JSON and metrics.
std::string_view name_of(DropReason reason);

/// One counter a reason.
class DropCounters {
 public:
  void add(DropReason reason, std::uint64_t n = 1) { counts_[static_cast<std::size_t>(reason)] += n; }
  std::uint64_t of(DropReason reason) const { return counts_[static_cast<std::size_t>(reason)]; }

 private:
  std::array<std::uint64_t, static_cast<std::size_t>(DropReason::kCount)> counts_{};
};

}  // namespace tandem::proto
