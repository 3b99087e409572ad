// One direction of a wave over a network that loses, bunches and repeats: what is sent is the wave's integral over
// time, so that the newest value alone is enough, and what is played has no more energy than was put in.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/time.hpp"
#include "common/haptics/wave/wave.hpp"

namespace tandem::haptics {

/// √W·s; a difference of half of it is minutes of full force.
inline constexpr double kWaveSumRange = 2048.0;

/// The sum of a wave over time, as it travels, one period on.
///
/// Model   U_k = U_{k−1} + u_k T, each number wrapped to [−kWaveSumRange, kWaveSumRange): a reader takes differences, so
///         the sum may go round, and a message's numbers stay bounded however long somebody presses
Wave wave_sum(const Wave& sum_before, const Wave& wave, double period_s) noexcept;

/// b − a on the wrapped scale of wave_sum(); what is not finite gives zero.
Wave wave_difference(const Wave& b, const Wave& a) noexcept;

/// Plays a received wave.
///
/// Model   an arrival that covers Δt of the sender's time and adds ΔU is played as the constant wave ΔU / Δt for Δt, in
///         order; while nothing waits, 0 is. So what waits grows to what the network's jitter demands, as a playout
///         buffer. Then a first-order filter of time constant τ takes the edge off such gaps.
///         Energy: neither gives more than it gets, over any loss, jitter, repetition and delay: the mean of a wave has
///         at most its energy (Cauchy–Schwarz), and y_k = (1 − a) y_{k−1} + a u_k gives Σ y² ≤ Σ u² (convexity).
///         While more waits than was needed in the last second, a twentieth of it is skipped: the wave keeps its height
///         and loses some of its integral, which the tool's end makes up for (WaveToolPort, drift).
/// Limits  At most kMaxWaiting_s waits: a sender whose clock runs so far ahead of what is played starts anew, and what
///         waited is discarded. That takes energy away and gives none.
/// Source  integrals: Niemeyer, Slotine, "Telemanipulation with time delays", Int. J. Robotics Research 23(9), 2004;
///         playing and skipping are ours
/// In      arrivals with stamps of the sender's clock; one that is not newer, or not finite, is ignored. A sum that
///         jumped by more than the largest wave makes is one that was started anew: it is counted from there.
/// Thread  haptic or room: no allocation, no throw
class WavePlayer {
 public:
  struct Settings {
    double smoothing_s = 0.005;   ///< τ: longer softens gaps, and is delay
    double limit_sqrt_w = 100.0;  ///< no wave is larger
    double longest_gap_s = 1.0;   ///< a sender silent for longer starts anew: nothing is made up for
    double margin_s = 0.005;      ///< of what waits, not skipped
    double skipped_share = 0.05;  ///< of the time, while too much waits; 0: never
  };
  explicit WavePlayer(const Settings& settings) : settings_(settings) {}

  void receive(Duration sender_time, const Wave& sum) noexcept;
  /// The wave of the coming period.
  Wave play(double period_s) noexcept;
  void reset() noexcept { *this = WavePlayer(settings_); }

  /// Twice what the longest gap that is played can let wait.
  static constexpr double kMaxWaiting_s = 2.0;

  const Settings& settings() const noexcept { return settings_; }
  /// How much of the sender's time has come and not been played.
  double waiting_s() const noexcept { return waiting_s_; }

 private:
  struct Stretch {
    Wave wave;
    double left_s = 0;
  };
  static constexpr std::size_t kMaxStretches = 256;  ///< more are merged into their mean
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
  double least_waiting_s_ = 0;  ///< of the second that runs
  double surplus_s_ = 0;        ///< to be skipped
  Wave filtered_;
};

}  // namespace tandem::haptics
