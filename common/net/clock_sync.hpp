// Offset of the server's clock from the local clock, from four time stamps.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/base/time.hpp"

namespace tandem::net {

/// Estimates the offset from the least delayed exchanges of the last seconds, and follows it without steps.
///
/// Model   An exchange has delay δ = (t4 − t1) − (t3 − t2) and offset θ = ((t2 − t1) + (t3 − t4)) / 2. The offset errs
///         by half the difference between the forward and the return delay. Each of the last kSlots periods of kSlot
///         keeps its exchange of least δ. Of these, the one of least δ/2 + kDrift · age is the target: queueing
///         corrupts new exchanges, drift of the clocks old ones. Error of the target ≤ |fixed asymmetry| / 2 +
///         (queueing of the least δ kept) / 2 + kDrift · its age.
/// Settle  For kSettling after the first exchange the offset equals the target, steps included. The start ramp keeps
///         forces small then, and correcting a first exchange that queued for 200 ms would otherwise take minutes.
/// Slew    Afterwards it moves at 500 ppm, or at error / 2 s if that is more, at most 5 %. An error of 1 ms vanishes in
///         2 s; one of 100 ms falls to 1 ms in 10 s. Server time never stops or steps.
/// Source  RFC 5905 (clock filter, error that grows with age, NTP's slew of 500 ppm); the rest is ours
/// Cost    add() O(kSlots), no allocation
class ClockSync {
 public:
  /// Adds an exchange: sent locally at t1, received by the server at t2, answered at t3, received locally at t4.
  /// Returns false and ignores it if the round trip or the holding time is negative.
  bool add(LocalTime t1, ServerTime t2, ServerTime t3, LocalTime t4);

  bool has_offset() const { return has_offset_; }
  /// Server time − local time, slewed up to `now`.
  Duration offset(LocalTime now);
  std::optional<ServerTime> server_time(LocalTime now);
  /// Round trip of the newest exchange, without the server's holding time.
  Duration round_trip() const { return round_trip_; }
  /// Least round trip of the last seconds; 0 before the first exchange.
  Duration minimum_round_trip() const;
  /// Discards all exchanges: the next one is with another server, or with the same one restarted.
  void reset() { *this = ClockSync(); }

 private:
  /// The least delayed exchange of one period; `slot` counts periods since the clock's epoch.
  struct Sample {
    Duration offset{0};
    Duration delay{0};
    LocalTime at{};
    Duration::rep slot = 0;
    bool is_used = false;
  };
  static constexpr std::size_t kSlots = 64;
  static constexpr Duration kSlot{std::chrono::milliseconds(100)};
  static constexpr Duration kSettling{std::chrono::seconds(1)};
  /// Drift between two free-running crystals of ±50 ppm each.
  static constexpr double kDrift = 100e-6;
  static constexpr double kSlowestSlew = 500e-6;
  static constexpr double kFastestSlew = 0.05;
  static constexpr double kSlewTimeConstantS = 2.0;

  void remember(const Sample& sample);
  Duration best_offset(LocalTime now) const;
  void slew(LocalTime now);

  std::array<Sample, kSlots> samples_{};
  Duration round_trip_{0};
  Duration target_{0};
  Duration current_{0};
  LocalTime first_at_{};
  LocalTime slewed_at_{};
  bool has_offset_ = false;
};

}  // namespace tandem::net
