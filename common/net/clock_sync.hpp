// Estimates the offset of the server's clock from the local clock by exchanges of four time stamps.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/base/time.hpp"

namespace tandem::net {

/// Estimates the offset from the exchanges that had the smallest delay during the last seconds. After an initial
/// settling time, the estimate changes gradually, without steps.
///
/// Model   An exchange has the delay δ = (t4 − t1) − (t3 − t2) and the offset θ = ((t2 − t1) + (t3 − t4)) / 2. The
///         error of θ is half the difference between the forward and the return delay.
///         Time is divided into periods of length kSlot. For each of the last kSlots periods, the exchange with the
///         smallest δ is stored.
///         The target of the estimate is the stored θ with the smallest δ/2 + kDrift · age. The first term is an upper
///         bound of the error by queueing, the second of the error by clock drift.
///         Error of the target ≤ |fixed asymmetry| / 2 + (queueing in its exchange) / 2 + kDrift · its age.
/// Settle  During kSettling after the first exchange the offset equals the target, even if the target steps. Such steps
///         are harmless, because the forces are still small (start ramp). If the offset were slewed from the beginning,
///         a first exchange that was queued for 200 ms would need about 10 s to be corrected.
/// Slew    After settling, the offset moves towards the target at the rate error / 2 s, clamped to 500 ppm … 5 %. An
///         error of 1 ms vanishes in 2 s; an error of 100 ms decreases to 1 ms in 10 s. Server time never stops or
///         steps.
/// Source  RFC 5905 (clock filter, error bound that grows with age, NTP's slew of 500 ppm); the rest is our design
/// Cost    add() O(kSlots), no allocation
class ClockSync {
 public:
  /// Adds an exchange. The request was sent at t1 (local clock) and received at t2 (server clock); the answer was sent
  /// at t3 (server clock) and received at t4 (local clock). If the round trip or the server's holding time is negative,
  /// the exchange is ignored and the result is false.
  bool add(LocalTime t1, ServerTime t2, ServerTime t3, LocalTime t4);

  bool has_offset() const { return has_offset_; }
  /// Returns server time − local time, slewed up to `now`.
  Duration offset(LocalTime now);
  std::optional<ServerTime> server_time(LocalTime now);
  /// Round-trip time of the newest exchange, without the server's holding time.
  Duration round_trip() const { return round_trip_; }
  /// Returns the smallest round-trip time of the stored exchanges; 0 before the first exchange.
  Duration minimum_round_trip() const;
  /// Discards all exchanges; call it when the server changes or restarts.
  void reset() { *this = ClockSync(); }

 private:
  /// The exchange with the smallest delay within one period. `slot` is the number of the period since the clock's
  /// epoch.
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
  /// Maximum relative drift of two free-running crystals with tolerances of ±50 ppm each.
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
