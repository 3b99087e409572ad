// The time of day by which invitations are valid. Errors of the machine's clock are common: it is set while the server runs, or is
// wrong for a moment after the machine's start.
//
//   monotonic clock + offset ──▶ at()      the offset follows the wall clock at once where both differ by at most 1 s (drift),
//                                          and where a larger step has lasted for 10 s
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/time.hpp"

namespace tandem::server {

/// How long the wall clock must stay set to another time until that time is used.
inline constexpr Duration kClockHold = std::chrono::seconds(10);

/// Milliseconds since 1970, UTC.
///
/// Thread  one
class UnixTime {
 public:
  /// In      last_ms  time in the run before. The first reading of a wall clock that is behind it counts as a step back
  explicit UnixTime(std::uint64_t last_ms = 0) : last_ms_(last_ms) {}

  /// Compares with the wall clock: at least once a second, so that a step back and forth is seen.
  /// Out     the time
  std::uint64_t update(std::uint64_t wall_ms, LocalTime now);
  /// After the first update().
  std::uint64_t at(LocalTime now) const;
  /// Until the time follows the wall clock; nothing: it does.
  std::optional<Duration> follows_in(LocalTime now) const;

 private:
  std::uint64_t last_ms_;
  std::optional<std::int64_t> offset_ms_{};  ///< to the monotonic clock
  std::optional<std::int64_t> step_ms_{};    ///< likewise of the wall clock, where that differs
  LocalTime stepped_{};
};

/// "2026-11-22 05:15:07 UTC"
std::string utc_text(std::uint64_t unix_ms);

}  // namespace tandem::server
