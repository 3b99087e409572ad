// One direction of a wave over a network with loss, bunching and duplicates. The wave's integral over time is sent, so
// that the newest value alone suffices. The played wave has at most the energy of the sent one.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/haptics/wave/wave.hpp"

namespace tandem::haptics {

/// Range of a sum [√W·s]; a difference of half of it is minutes of full force.
inline constexpr double kWaveSumRange = 2048.0;

/// Returns the integral of a wave over time, one period further.
///
/// Model   U_k = U_{k−1} + u_k T, each number wrapped to [−kWaveSumRange, kWaveSumRange). A reader uses differences, so
///         the sum may wrap, and a message's numbers stay bounded for any duration of a press
Wave wave_sum(const Wave& sum_before, const Wave& wave, double period_s) noexcept;

/// Returns b − a on the wrapped scale of wave_sum(); zero for a difference that is not finite.
Wave wave_difference(const Wave& b, const Wave& a) noexcept;

/// Plays a received wave.
///
/// Model   an arrival that covers Δt of the sender's time and adds ΔU is played as the constant wave ΔU / Δt for Δt, in
///         order. While nothing is queued, 0 is played. The queue therefore grows to the network's jitter, as in a
///         playout buffer. A first-order filter of time constant τ then smooths the gaps.
///         Energy: neither stage returns more than it receives, for any loss, jitter, repetition and delay. The mean of
///         a wave has at most its energy (Cauchy–Schwarz), and y_k = (1 − a) y_{k−1} + a u_k gives Σ y² ≤ Σ u²
///         (convexity).
///         While the queue is longer than was needed in the last second, a twentieth of it is skipped: the wave keeps
///         its height and loses some of its integral, which the tool's end corrects (WaveToolPort, drift).
/// Limits  The queue holds at most kMaxWaiting_s. A sender whose clock runs further ahead starts anew, and the queue is
///         discarded. That only removes energy.
/// Source  integrals: Niemeyer, Slotine, "Telemanipulation with time delays", Int. J. Robotics Research 23(9), 2004;
///         playing and skipping are ours
/// In      arrivals with time stamps of the sender's clock; one that is not newer, or not finite, is ignored. A sum
///         that jumps by more than the largest wave allows is a restart and becomes the new reference.
/// Thread  haptic or room: no allocation, no throw
class WavePlayer {
 public:
  struct Settings {
    double smoothing_s = 0.005;   ///< τ: a longer one smooths gaps more, but adds delay
    double limit_sqrt_w = 100.0;  ///< bound of the wave's magnitude
    double longest_gap_s = 1.0;   ///< a sender silent for longer starts anew: the gap is not filled
    double margin_s = 0.005;      ///< part of the queue that is not skipped
    double skipped_share = 0.05;  ///< share of the time while the queue is too long; 0: never
  };
  explicit WavePlayer(const Settings& settings) : settings_(settings) {}

  void receive(Duration sender_time, const Wave& sum) noexcept;
  /// Returns the wave of the coming period.
  Wave play(double period_s) noexcept;
  void reset() noexcept { *this = WavePlayer(settings_); }

  /// Twice the longest gap that is played.
  static constexpr double kMaxWaiting_s = 2.0;

  const Settings& settings() const noexcept { return settings_; }
  /// Received and not yet played part of the sender's time.
  double waiting_s() const noexcept { return waiting_s_; }

 private:
  struct Stretch {
    Wave wave;
    double left_s = 0;
  };
  static constexpr std::size_t kMaxStretches = 256;  ///< further ones are merged into their mean
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
  double least_waiting_s_ = 0;  ///< minimum of the current second
  double surplus_s_ = 0;        ///< time still to be skipped
  Wave filtered_;
};

}  // namespace tandem::haptics
