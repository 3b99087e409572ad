// One user's inputs, played out at a constant delay after they came: what the network does to their order and spacing
// then costs neither force nor energy, as long as it is within that delay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/spatial.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::server {

/// What a room uses of an input.
struct PlayedInput {
  Tick tick;  ///< of exactly which the rest is; while it runs on and until what is due has come: which it stands for
  RigidState handle;
  std::uint32_t buttons = 0;      ///< of a tick that did not come, those of the next that did: not later than pressed
  double energy_to_hand_j = 0;    ///< as in ClientUpdate
  double energy_from_hand_j = 0;  ///< likewise
  Wrench on_hand_W;               ///< likewise
  bool has_underrun = false;      ///< nothing newer has come: the last is held
  Duration sent{0};               ///< by the client's clock, of a tick that came
};

/// Plays a client's handle, buttons, energies and what its hand is shown at a delay that nearly all of its inputs keep, one of
/// its ticks after the other.
///
/// Model   The delay is PlayoutDelay's, of stamps by the client and steps of the room.
///         A tick that did not come is put between its neighbours: a cubic for the position and for the rotation
///         vector from the first to the second, with their twists at its ends. It errs by T⁴/384 max|x⁗| over a gap
///         of T. Energies and wrenches go evenly. Which tick is played moves on by as many as fit into a step, and changes stride
///         only when it has drifted 0.75 ticks from where the delay wants it: a jitter of time stamps moves nothing.
///         On underrun, the last one's poses are held and its twists fade to zero in kTwistFade_s; what then comes is
///         caught up with at 5/4 of the hand's pace, two of its ticks in every fourth step, not by a jump.
///         With run_on() the hand is taken to go on as it went, slower and slower until kRunOn_s, by kRunOnMost_m at most;
///         what is then played counts as the tick that is due, for at a known place of an old one the hand is known to be no
///         more. What then comes is played at once from where it is due, and the difference goes within some kLeadFade_s.
/// Limits  a client that leaves gaps by itself (a deadband) is played later by their length
/// Thread  the room's; time is counted in steps; no allocation
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

  /// A valid input that is first seen in the step at `now`; one that is not newer than the last is not taken.
  void take(const proto::ClientUpdate& update, Duration now) noexcept;
  /// What is played in the step at `now`; once a step. Before the first input is due it is that one, held; nothing
  /// when there is none.
  std::optional<PlayedInput> play(Duration now) noexcept;
  /// Of an input that play() just gave with an underrun: the hand goes on. Where it has stopped instead, its tool presses by
  /// as much more; so it is for one that would lose what it shares, or that would stop what it carries and fling it after.
  void run_on(PlayedInput& played) noexcept;
  /// Starts anew: there is no way from the inputs so far to the next.
  void reset() noexcept;

  /// By how much what is played is later than the least late input would allow; 0 before the first.
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
  std::uint32_t steps_behind_ = 0;  ///< in a row
  double underrun_s_ = 0;
  bool has_run_on_ = false;
  std::uint64_t due_ = 0;         ///< tick, there or not
  std::uint64_t ran_to_ = 0;      ///< tick; 0: it never ran on
  Vec3 lead_ = Vec3::Zero();      ///< of what is played before what came
  Vec3 played_p_ = Vec3::Zero();  ///< with it

  net::PlayoutDelay delay_{kDelay};
};

}  // namespace tandem::server
