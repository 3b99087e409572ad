// Unix time for the validity of invitations. The wall clock of the machine cannot always be trusted: it may be set
// while the server runs, or be wrong for a moment after the machine has started.
//
//   at() = monotonic clock + offset    A deviation of the wall clock of at most 1 s (drift) changes the offset at once.
//                                      A larger step is followed after it has persisted for 10 s.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/time.hpp"

namespace tandem::server {

/// A step of the wall clock that persists for this time is accepted as correct.
inline constexpr Duration kClockHold = std::chrono::seconds(10);

/// Filtered Unix time in milliseconds since 1970, UTC.
///
/// Thread  any, one at a time
class UnixTime {
 public:
  /// In      last_ms  last time noted in the previous run [ms since 1970]. If the first reading of the wall clock is
  ///                  earlier, the clock counts as set back
  explicit UnixTime(std::uint64_t last_ms = 0) : last_ms_(last_ms) {}

  /// Updates the offset from the wall clock. Call it at least once per second. With rarer calls, a short step of the
  /// clock could look persistent.
  /// Out     current time
  std::uint64_t update(std::uint64_t wall_ms, LocalTime now);
  /// Current time; requires an earlier update().
  std::uint64_t at(LocalTime now) const;
  /// Returns the remaining time until a pending step of the wall clock is accepted; none if no step is pending.
  std::optional<Duration> follows_in(LocalTime now) const;

 private:
  std::uint64_t last_ms_;
  std::optional<std::int64_t> offset_ms_{};  ///< Unix time minus monotonic clock
  std::optional<std::int64_t> step_ms_{};    ///< offset after the pending step; none if there is no pending step
  LocalTime stepped_{};                      ///< time at which the pending step was detected
};

/// Formats a time, for example "2026-11-22 05:15:07 UTC".
std::string utc_text(std::uint64_t unix_ms);

}  // namespace tandem::server
