// Playout buffer: replays received data with a constant delay, so that jitter and short losses change neither the data
// nor the energy in the data. The buffer is used for the inputs of a simulation and for the display. It must not be
// used for a force on a haptic device, because the added delay would reduce stability.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

struct PlayoutSettings {
  double quantile = 0.98;  ///< fraction of the time for which the next sample arrives before it is needed
  Duration window{std::chrono::seconds(2)};  ///< period of which the quantile is taken (varies up to twice this value)
  Duration longest{std::chrono::milliseconds(60)};  ///< maximum playout delay
  double slew = 0.05;                               ///< maximum relative deviation of the playout speed from 1
};

/// Chooses the playout delay, and converts local time to the sender's time that is to be played.
///
/// Model   Symbols: s_i is the sender's time stamp of sample i, a_i its local arrival time. base is the least a − s.
///         When sample i arrives, all times from s_{i−1} to s_i become playable, because the pose at these times can be
///         interpolated. The time s_{i−1} has waited longest for sample i: for a_i − s_{i−1} − base.
///         The playout delay is the quantile of this waiting time. Each waiting time has the gap s_i − s_{i−1} as its
///         weight, so the delay covers jitter and also gaps caused by losses.
///         The statistics consist of two parts of one window each. When a new part begins, the older part is discarded,
///         so the statistics cover 1 to 2 windows. The resolution is 0.5 ms.
/// Settle  the delay changes in one step during the first half second, and after clock jumps of more than 200 ms
/// Source  idea: Ramjee, Kurose, Towsley, Schulzrinne, "Adaptive playout mechanisms for packetized audio applications
///         in wide-area networks", INFOCOM 1994; the weighting by gaps and the slew are our design
/// Thread  always the same thread; no allocation
class PlayoutDelay {
 public:
  explicit PlayoutDelay(const PlayoutSettings& settings = {}) : settings_(settings) {}

  /// In      sampled  time of the sample on the sender's clock; samples not newer than the last one are ignored
  ///         arrived  time of its arrival on the local clock
  void add(Duration sampled, Duration arrived) noexcept;
  /// Returns the time on the sender's clock whose sample is to be played at local time `now`. `now` must not decrease
  /// from call to call. At least one call of add() must precede.
  Duration play_at(Duration now) noexcept;
  bool has_started() const { return has_started_; }
  /// Returns the current playout delay: the local time at which a sample is played minus the time at which it would
  /// have arrived with the smallest delay.
  Duration delay() const noexcept;
  void reset() noexcept { *this = PlayoutDelay(settings_); }

 private:
  static constexpr std::size_t kBins = 400;
  static constexpr Duration kBin{std::chrono::microseconds(500)};
  struct Half {
    std::array<std::uint32_t, kBins> weight_us{};  ///< histogram: total length of the gaps [µs] by waiting time
    std::uint64_t sum_us = 0;
    Duration base{0};
    bool is_used = false;
  };
  Duration base() const noexcept;
  Duration target() const noexcept;

  PlayoutSettings settings_;
  std::array<Half, 2> halves_{};
  std::size_t newer_ = 0;
  Duration half_began_{0};
  Duration started_{0};
  Duration last_sampled_{0};
  Duration offset_{0};  ///< local time minus played time
  Duration played_at_{0};
  bool has_started_ = false;
  bool has_played_ = false;
};

/// Stores the newest states of one rigid body by the sender's time, and interpolates between them.
///
/// Model   Between two samples the position is a cubic Hermite polynomial of the samples' positions and velocities. The
///         rotation follows the shorter arc at constant speed; the twist is linear.
///         After the newest sample, the pose is extrapolated with its twist, which decreases to zero within kRunOut.
///         Across a gap longer than kMaxGap nothing is interpolated, and the samples before the gap are discarded. A
///         false time stamp can therefore move a body at most as far as its speed moves it within kMaxGap.
/// Thread  always the same thread; no allocation
class RigidTrack {
 public:
  static constexpr std::size_t kSamples = 128;
  /// Maximum extrapolation time after the newest sample.
  static constexpr Duration kRunOut{std::chrono::milliseconds(20)};
  /// Longest gap between samples that is interpolated. It exceeds the normal intervals: even items sent at a reduced
  /// rate arrive within 0.4 s (proto/WIRE.md, Thinning).
  static constexpr Duration kMaxGap{std::chrono::seconds(1)};

  /// Adds a sample. A sample that is not newer than the newest stored one is ignored.
  void add(Duration sampled, const RigidState& state) noexcept;
  bool is_empty() const { return count_ == 0; }
  RigidState at(Duration time) const noexcept;
  const RigidState& newest() const { return sample(count_ - 1).state; }
  Duration newest_time() const { return sample(count_ - 1).time; }
  void reset() noexcept { count_ = 0; }

 private:
  struct Sample {
    Duration time{0};
    RigidState state;
  };
  /// Returns a stored sample; index 0 is the oldest.
  const Sample& sample(std::size_t index) const { return samples_[(first_ + index) % kSamples]; }
  /// Returns the index of the first sample after `time`; count_ if there is none.
  std::size_t after(Duration time) const noexcept;

  std::array<Sample, kSamples> samples_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tandem::net
