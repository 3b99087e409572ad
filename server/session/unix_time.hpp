// Time of day for the validity of invitations. Errors of the machine's clock are common: it may be set while the server
// runs, or be wrong for a moment after the machine's start.
//
//   monotonic clock + offset ──▶ at()    the offset follows the wall clock at once if both differ by at most 1 s
//                                        (drift), and a larger step once it has lasted for 10 s
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/time.hpp"

namespace tandem::server {

/// Time for which the wall clock must keep a step before the step is followed.
inline constexpr Duration kClockHold = std::chrono::seconds(10);

/// Milliseconds since 1970, UTC.
///
/// Thread  one
class UnixTime {
 public:
  /// In      last_ms  time noted in the previous run; a first reading behind it counts as a backward step
  explicit UnixTime(std::uint64_t last_ms = 0) : last_ms_(last_ms) {}

  /// Compares with the wall clock. Call at least once a second, so that a step back and forth is noticed.
  /// Out     the time
  std::uint64_t update(std::uint64_t wall_ms, LocalTime now);
  /// Current time; requires an earlier update().
  std::uint64_t at(LocalTime now) const;
  /// Time left until a step of the wall clock is followed; nothing: there is no pending step.
  std::optional<Duration> follows_in(LocalTime now) const;

 private:
  std::uint64_t last_ms_;
  std::optional<std::int64_t> offset_ms_{};  ///< from the monotonic clock
  std::optional<std::int64_t> step_ms_{};    ///< pending offset of the wall clock, if it differs
  LocalTime stepped_{};
};

/// "2026-11-22 05:15:07 UTC"
std::string utc_text(std::uint64_t unix_ms);

}  // namespace tandem::server
