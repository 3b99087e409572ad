// One direction of a wave transmission over a network with loss, bunching and duplicates. The sender transmits the
// wave's integral over time, so the newest message alone suffices. The played wave has at most the energy of the sent
// wave.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/haptics/wave/wave.hpp"

namespace tandem::haptics {

/// Range of the transmitted integral [√W·s]. Even at full force, the integral takes minutes to reach half of this
/// range.
inline constexpr double kWaveSumRange = 2048.0;

/// Adds one period to the integral of a wave over time. Returns the new integral.
///
/// Model   U_k = U_{k−1} + u_k T, with the integral U_k, the wave u_k and the period T. Each component is wrapped to
///         [−kWaveSumRange, kWaveSumRange), so that the sent numbers stay bounded for a contact of any duration.
///         Wrapping does no harm, because the receiver uses only differences
Wave wave_sum(const Wave& sum_before, const Wave& wave, double period_s) noexcept;

/// Returns b − a on the wrapped scale of wave_sum(); zero if the difference is not finite.
Wave wave_difference(const Wave& b, const Wave& a) noexcept;

/// Plays back a received wave.
///
/// Model   Playing: a message that covers Δt of the sender's time and adds ΔU to the integral is played as the constant
///         wave ΔU / Δt for the time Δt. Messages are played in order. While the queue is empty, 0 is played. The queue
///         therefore grows to the network's jitter, as in a playout buffer. A first-order filter with the time constant
///         τ then smooths the gaps.
///         Energy: neither the queue nor the filter returns more energy than it receives, for any loss, jitter,
///         repetition and delay. For the queue: the mean of a wave has at most the energy of the wave (Cauchy–Schwarz).
///         For the filter: y_k = (1 − a) y_{k−1} + a u_k has Σ y² ≤ Σ u² (convexity).
///         Skipping: the minimum queue length during the last second, less margin_s, was not needed to bridge gaps.
///         This surplus is removed by skipping one twentieth of the played time. The wave keeps its amplitude, but
///         loses a part of its integral. WaveToolPort corrects the resulting drift of the tool's pose
/// Limits  The queue holds at most kMaxWaiting_s. If the sender's clock runs further ahead, the queue is discarded and
///         playing starts anew. Discarding a queue only removes energy
/// Source  integrals: Niemeyer, Slotine, "Telemanipulation with time delays", Int. J. Robotics Research 23(9), 2004;
///         playing and skipping are ours
/// In      messages with time stamps of the sender's clock. A message that is not finite, or not newer than the last
///         one, is ignored. If the integral changes by more than the largest wave allows, the sender was restarted. The
///         message then becomes the new reference.
/// Thread  haptic or room: no allocation, no throw
class WavePlayer {
 public:
  struct Settings {
    double smoothing_s = 0.005;   ///< τ; a larger value smooths gaps more, but adds delay
    double limit_sqrt_w = 100.0;  ///< upper bound of the wave's magnitude
    double longest_gap_s = 1.0;   ///< after a longer silence of the sender, playing starts anew; the gap is not filled
    double margin_s = 0.005;      ///< minimum length of the queue that skipping leaves [s]
    double skipped_share = 0.05;  ///< fraction of the played time that is skipped; 0: none
  };
  explicit WavePlayer(const Settings& settings) : settings_(settings) {}

  void receive(Duration sender_time, const Wave& sum) noexcept;
  /// Returns the wave for the coming period.
  Wave play(double period_s) noexcept;
  void reset() noexcept { *this = WavePlayer(settings_); }

  /// Maximum length of the queue: twice the longest gap that is filled.
  static constexpr double kMaxWaiting_s = 2.0;

  const Settings& settings() const noexcept { return settings_; }
  /// Duration, on the sender's clock, of the waves that were received but not yet played.
  double waiting_s() const noexcept { return waiting_s_; }

 private:
  struct Stretch {
    Wave wave;
    double left_s = 0;
  };
  static constexpr std::size_t kMaxStretches = 256;  ///< if there are more, the newest two are merged into their mean
  static constexpr double kWatched_s = 1.0;

  void append(const Stretch& stretch) noexcept;
  Wave next(double period_s) noexcept;
  void watch_waiting(double period_s) noexcept;

  Settings settings_;
  bool has_received_ = false;
  Duration newest_{0};
  Wave received_;
  std::array<Stretch, kMaxStretches> stretches_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  double waiting_s_ = 0;
  double watched_s_ = 0;
  double least_waiting_s_ = 0;  ///< minimum queue length in the current second
  double surplus_s_ = 0;        ///< time that has still to be skipped
  Wave filtered_;
};

}  // namespace tandem::haptics
