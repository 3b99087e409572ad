// How far the server's clock is ahead of ours, from four time stamps.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/time.hpp"

namespace tandem {

/// One exchange: we sent at t1, the server received at t2 and sent at t3, we received at t4.
struct TimeExchange {
  LocalTime t1;
  ServerTime t2;
  ServerTime t3;
  LocalTime t4;
};

/// Estimates the offset; the sample of least delay of the last few counts, and the answer is slewed.
///
/// Model   offset = ((t2 − t1) + (t3 − t4)) / 2, error ≤ half the round trip's asymmetry
/// Source  RFC 5905 (clock filter); the slew is ours: the clock that prediction sees must not step
class ClockSync {
 public:
  /// Adds an exchange; one with a negative round trip is ignored (false).
  bool add(const TimeExchange& exchange);

  bool has_offset() const { return has_offset_; }
  /// server − local, slewed up to `now`. The first exchange sets it at once.
  Duration offset(LocalTime now);
  std::optional<ServerTime> server_time(LocalTime now);
  /// Round trip of the newest exchange, without the server's holding time.
  Duration round_trip() const { return round_trip_; }
  Duration minimum_round_trip() const;

 private:
  struct Sample {
    Duration offset{0};
    Duration delay{0};
  };
  static constexpr std::size_t kSamples = 64;
  /// Fastest change of the offset: 500 ppm, as NTP slews.
  static constexpr double kSlewPerSecond = 500e-6;

  std::array<Sample, kSamples> samples_{};
  std::size_t count_ = 0;
  Duration round_trip_{0};
  Duration target_{0};
  Duration current_{0};
  LocalTime slewed_at_{};
  bool has_offset_ = false;
};

}  // namespace tandem
