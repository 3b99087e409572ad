// How far the server's clock is ahead of ours, from four time stamps.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/base/time.hpp"

namespace tandem::net {

/// Estimates the offset from the least delayed exchanges of the last seconds, and follows it without steps.
///
/// Model   An exchange has delay δ = (t4 − t1) − (t3 − t2) and offset θ = ((t2 − t1) + (t3 − t4)) / 2, which errs
///         by half of what its way there and its way back differ. Each of the last kSlots periods of kSlot keeps
///         its exchange of least δ; of those the one of least δ/2 + kDrift · age is the target: queueing hurts
///         now, drift of the clocks hurts what is old.
///         Error of the target ≤ |fixed asymmetry| / 2 + (queueing of the least δ kept) / 2 + kDrift · its age.
/// Settle  For kSettling after the first exchange the answer *is* the target, steps included: the start ramp keeps
///         forces small, and a first exchange that queued for 200 ms would else take minutes to forget.
/// Slew    Later it moves at 500 ppm, or at error / 2 s when that is more, at most 5 %: an error of 1 ms is gone
///         in 2 s, of 100 ms is down to 1 ms in 10 s, and server time never stands still or steps.
/// Source  RFC 5905 (clock filter, error that grows with age, 500 ppm as NTP slews); the rest is ours
/// Cost    add() O(kSlots), no allocation
class ClockSync {
 public:
  /// Adds an exchange: we sent at t1, the server received at t2 and sent at t3, we received at t4. One with a negative
  /// round trip or holding time is ignored (false).
  bool add(LocalTime t1, ServerTime t2, ServerTime t3, LocalTime t4);

  bool has_offset() const { return has_offset_; }
  /// server − local, slewed up to `now`.
  Duration offset(LocalTime now);
  std::optional<ServerTime> server_time(LocalTime now);
  /// Round trip of the newest exchange, without the server's holding time.
  Duration round_trip() const { return round_trip_; }
  /// Least round trip of the last seconds; 0 before the first exchange.
  Duration minimum_round_trip() const;
  /// Forgets everything: the next exchange is with another server, or the same one started anew.
  void reset() { *this = ClockSync(); }

 private:
  /// The exchange of least delay of one period; `slot` counts periods since the clock's epoch.
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
  /// Two free-running crystals of ±50 ppm each.
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
