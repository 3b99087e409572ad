// Playout of one user's inputs at a constant delay. Changes of their order and spacing by the network then cost neither
// force nor energy, as long as they stay within that delay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/spatial.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::server {

/// Input as the room uses it.
struct PlayedInput {
  /// Tick of the values. During run_on(), and until the due tick has arrived, the tick that they represent instead.
  Tick tick;
  RigidState handle;
  std::uint32_t buttons = 0;      ///< for a lost tick from the next received one, so never late
  double energy_to_hand_j = 0;    ///< from ClientUpdate
  double energy_from_hand_j = 0;  ///< from ClientUpdate
  Wrench on_hand_W;               ///< from ClientUpdate
  bool has_underrun = false;      ///< no newer input has arrived: the last is held
  Duration sent{0};               ///< client clock; zero for a lost tick
};

/// Plays out a client's handle, buttons, energies and displayed wrench tick by tick, at a delay that nearly all of its
/// inputs meet.
///
/// Model   The delay is that of PlayoutDelay, from the client's stamps and the room's steps.
///         Lost ticks are interpolated between their neighbours. The position and the rotation vector between them
///         follow cubics with the neighbours' twists at the ends. Their error is at most T⁴/384 max|x⁗| over a gap of
///         T. Energies and wrenches are interpolated linearly. The played tick advances by the ticks per step. It
///         changes this stride only after a drift of 0.75 ticks from the wanted delay, so jitter of time stamps has no
///         effect.
///         On underrun the last pose is held and its twist fades to zero in kTwistFade_s. Later inputs are caught up
///         with at 5/4 of the hand's pace, two ticks in every fourth step, not by a jump.
///         With run_on() the hand is extrapolated at a speed that falls to zero in kRunOn_s, by at most kRunOnMost_m.
///         The result counts as the tick that is due, because the old pose is known not to hold any more. The next
///         input is played at once at its due tick, and the difference fades within about kLeadFade_s.
/// Limits  a client that leaves gaps by itself (a deadband) is played later by their length
/// Thread  room; time is counted in steps; no allocation
class InputPlayout {
 public:
  static constexpr std::size_t kHistory = 128;
  static constexpr net::PlayoutSettings kDelay{.quantile = 0.985};
  static constexpr double kTwistFade_s = 0.020;
  static constexpr std::uint32_t kCatchUpSteps = 4;
  static constexpr double kRunOn_s = 0.25;
  static constexpr double kRunOnMost_m = 0.02;
  static constexpr double kLeadFade_s = 0.05;

  explicit InputPlayout(double step_s) : step_s_(step_s) {}

  /// Stores a valid input first seen in the step at `now`. Discards an input that is not newer than the last.
  void receive(const proto::ClientUpdate& update, Duration now) noexcept;
  /// Returns the input to use in the step at `now`; called once a step. Before the first input is due, it is held.
  /// Returns nothing when there is no input.
  std::optional<PlayedInput> play(Duration now) noexcept;
  /// Extrapolates the input that play() just returned with an underrun. If the hand has in fact stopped, its tool
  /// presses by that much more. Used only for a tool that would lose a shared object, or would stop a carried one and
  /// then fling it.
  void run_on(PlayedInput& played) noexcept;
  /// Discards all inputs; the next one is not connected with them.
  void reset() noexcept;

  /// Playout delay above the earliest that the least late input would allow; 0 before the first.
  Duration delay() const noexcept { return delay_.delay(); }

 private:
  const PlayedInput& input(std::size_t age) const noexcept;  ///< 0: the newest
  double ticks_per_second() const noexcept;
  double ticks_until(Duration client_time) const noexcept;
  void choose_tick(double wanted) noexcept;
  void lead(PlayedInput& played) noexcept;
  PlayedInput at_tick(std::uint64_t tick) const noexcept;

  double step_s_;
  std::array<PlayedInput, kHistory> inputs_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  std::uint64_t played_ = 0;        ///< tick; 0: none yet
  std::uint32_t steps_behind_ = 0;  ///< consecutive
  double underrun_s_ = 0;
  bool has_run_on_ = false;
  std::uint64_t due_ = 0;         ///< tick, received or not
  std::uint64_t ran_to_ = 0;      ///< tick; 0: the hand never ran on
  Vec3 lead_ = Vec3::Zero();      ///< offset of the played position from the received one
  Vec3 played_p_ = Vec3::Zero();  ///< includes lead_

  net::PlayoutDelay delay_{kDelay};
};

}  // namespace tandem::server
