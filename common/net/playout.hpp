// Playout buffer: replays received data at a constant delay, so that jitter and short losses change neither the data
// nor its energy. For inputs of a simulation and for display. Never for a force on its way to a hand, which would only
// get older.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

struct PlayoutSettings {
  double quantile = 0.98;                    ///< share of the time for which the next sample has arrived when needed
  Duration window{std::chrono::seconds(2)};  ///< over which the quantile is taken
  Duration longest{std::chrono::milliseconds(60)};  ///< limit of the delay; samples that are later are not waited for
  double slew = 0.05;                               ///< maximum relative change of the playing speed
};

/// Chooses the delay, and converts local time to the sender's time to play.
///
/// Model   A sample i with stamp s_i that arrives at a_i makes all times from s_{i−1} to s_i playable at a_i. These
///         times wait up to a_i − s_{i−1} − base, where base is the least a − s. The delay is the quantile of this
///         waiting time over the window, each gap weighted by its length. It covers jitter as well as gaps left by
///         losses. The effective window is 1 to 2 windows (two halves, the older discarded as a whole); resolution 0.5
///         ms.
/// Settle  in the first half second, and after clock jumps of more than 200 ms, the delay changes in one step
/// Source  Ramjee, Kurose, Towsley, Schulzrinne, "Adaptive playout mechanisms for packetized audio applications in
///         wide-area networks", INFOCOM 1994, for the idea; the bracketing gap and the slew are ours
/// Thread  one; no allocation
class PlayoutDelay {
 public:
  explicit PlayoutDelay(const PlayoutSettings& settings = {}) : settings_(settings) {}

  /// In      sampled  on the sender's clock, increasing; other samples are ignored
  ///         arrived  on the local clock
  void add(Duration sampled, Duration arrived) noexcept;
  /// The sender's time to play at local time `now`, which must not decrease. Call it only after the first add().
  Duration play_at(Duration now) noexcept;
  bool has_started() const { return has_started_; }
  /// Time by which playing lags behind the least delayed sample.
  Duration delay() const noexcept;
  void reset() noexcept { *this = PlayoutDelay(settings_); }

 private:
  static constexpr std::size_t kBins = 400;
  static constexpr Duration kBin{std::chrono::microseconds(500)};
  struct Half {
    std::array<std::uint32_t, kBins> weight_us{};  ///< weight of the gaps with this waiting time
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
  Duration offset_{0};  ///< local time − played time
  Duration played_at_{0};
  bool has_started_ = false;
  bool has_played_ = false;
};

/// The newest states of one rigid body, by the sender's time.
///
/// Model   Between two samples: cubic Hermite for the position, with the samples' velocities; the shorter rotation;
///         linear for the twist. After the newest sample: extrapolated with its twist, which fades to zero within
///         kRunOut. A gap longer than kMaxGap is not interpolated: the samples before it are discarded. Thus no time
///         stamp moves a body farther than its speed does in kMaxGap.
/// Thread  one; no allocation
class RigidTrack {
 public:
  static constexpr std::size_t kSamples = 128;
  /// Extrapolation time without new samples.
  static constexpr Duration kRunOut{std::chrono::milliseconds(20)};
  /// Longest gap between samples of one sender; thinned items arrive within 0.4 s (proto/WIRE.md, Thinning).
  static constexpr Duration kMaxGap{std::chrono::seconds(1)};

  /// A sample that is not newer than the newest is ignored.
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
  /// Sample by age: 0 is the oldest kept.
  const Sample& sample(std::size_t index) const { return samples_[(first_ + index) % kSamples]; }
  /// Index of the first sample after `time`; count_ if there is none.
  std::size_t after(Duration time) const noexcept;

  std::array<Sample, kSamples> samples_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tandem::net
