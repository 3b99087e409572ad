// Playing at a constant delay what came over a network with a varying one: jitter and short losses then change neither
// what is played nor its energy. For what drives a simulation or is shown; never for a force on its way to a hand,
// which would only get older.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

struct PlayoutSettings {
  double quantile = 0.98;                    ///< share of the time for which the next sample is there when needed
  Duration window{std::chrono::seconds(2)};  ///< that the quantile is of
  Duration longest{std::chrono::milliseconds(60)};  ///< what comes later than this is not waited for
  double slew = 0.05;                               ///< time is played at most by so much faster or slower
};

/// Chooses the delay, and turns own time into the sender's time to play.
///
/// Model   A sample i stamped s_i that arrives at a_i makes all times from s_{i−1} to s_i playable at a_i, so those
///         wait up to a_i − s_{i−1} − base, base the least a − s. The delay is the quantile of that waiting, over the
///         window, each gap with its length as weight: it covers jitter and the gaps that losses leave alike.
///         Between 1 and 2 windows are looked at (two halves, the older dropped as a whole); resolution 0.5 ms.
/// Settle  in the first half second, and when the clocks moved by more than 200 ms, the delay is taken at once
/// Source  Ramjee, Kurose, Towsley, Schulzrinne, "Adaptive playout mechanisms for packetized audio applications in
///         wide-area networks", INFOCOM 1994, for the idea; the bracketing gap and the slew are ours
/// Thread  one; no allocation
class PlayoutDelay {
 public:
  explicit PlayoutDelay(const PlayoutSettings& settings = {}) : settings_(settings) {}

  /// In      sampled  on the sender's clock, increasing; others are ignored. arrived  on the own clock
  void add(Duration sampled, Duration arrived) noexcept;
  /// The sender's time to play at own time `now`, which must not decrease. Only after the first add().
  Duration play_at(Duration now) noexcept;
  bool has_started() const { return has_started_; }
  /// What is played waits this long beyond the least delayed sample.
  Duration delay() const noexcept;
  void reset() noexcept { *this = PlayoutDelay(settings_); }

 private:
  static constexpr std::size_t kBins = 400;
  static constexpr Duration kBin{std::chrono::microseconds(500)};
  struct Half {
    std::array<std::uint32_t, kBins> weight_us{};  ///< of gaps that wait so long
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
  Duration offset_{0};  ///< own time − played time
  Duration played_at_{0};
  bool has_started_ = false;
  bool has_played_ = false;
};

/// The last states of one rigid thing, by the sender's time.
///
/// Model   between two samples: cubic Hermite for the position, with the samples' velocities; shortest turn for the
///         rotation; linear for the twist. After the newest: on with its twist, which fades to zero within kRunOut.
///         A gap longer than kMaxGap is not interpolated: the samples before it are discarded. So no stamp moves a
///         thing farther than its speed does in kMaxGap.
/// Thread  one; no allocation
class RigidTrack {
 public:
  static constexpr std::size_t kSamples = 128;
  /// What a thing may run on without news.
  static constexpr Duration kRunOut{std::chrono::milliseconds(20)};
  /// Of what one sender samples; thinned items come within 0.4 s (proto/WIRE.md, Thinning).
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
  /// 0 is the oldest kept.
  const Sample& sample(std::size_t index) const { return samples_[(first_ + index) % kSamples]; }
  /// Index of the sample after `time`; count_: none.
  std::size_t after(Duration time) const noexcept;

  std::array<Sample, kSamples> samples_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tandem::net
