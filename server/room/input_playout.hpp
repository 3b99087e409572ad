// Playout of one user's inputs at a constant delay. Jitter and reordering by the network then cause no error of force
// or energy, as long as they stay within that delay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/spatial.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::server {

/// One played input, as the room uses it.
struct PlayedInput {
  /// Client tick at which the values below are valid. After run_on() it is the extrapolated tick, until an input of the
  /// due tick arrives.
  Tick tick;
  RigidState handle;
  std::uint32_t buttons = 0;      ///< buttons; for a lost tick those of the next received tick, to avoid a late press
  double energy_to_hand_j = 0;    ///< cumulative energy as in ClientUpdate [J]
  double energy_from_hand_j = 0;  ///< cumulative energy as in ClientUpdate
  Wrench on_hand_W;               ///< wrench that the client displays to the hand, as in ClientUpdate
  bool has_underrun = false;      ///< no input of the due tick or later has arrived, so the last input is held
  Duration sent{0};               ///< time of sending by the client's clock; zero for a lost tick
};

/// Plays out a client's handle, buttons, energies and displayed wrench tick by tick. The delay is chosen so that nearly
/// all of the inputs arrive in time.
///
/// Model   1. Delay: that of PlayoutDelay, from the client's time stamps and the times of the room's steps.
///         2. Lost ticks are interpolated between their neighbours. Position and rotation vector follow cubics whose
///            end rates are the neighbours' twists. Over a gap of length T, the error of a motion x(t) is at most
///            T⁴/384 max|x⁗|. Energies and wrenches are interpolated linearly.
///         3. In each step the played tick advances by the same number of ticks, the stride. The stride changes only
///            after a drift of 0.75 ticks from the wanted delay, so jitter of time stamps has no effect.
///         4. Underrun: the last pose is held, and its twist fades to zero in kTwistFade_s. When inputs arrive again,
///            the playout catches up without a jump, at 5/4 of the hand's pace: two strides in every fourth step.
///         5. Underrun with run_on(): the hand is extrapolated at a speed that falls to zero in kRunOn_s, by at most
///            kRunOnMost_m. The extrapolated pose is assigned to the tick that is due. The next input is played at its
///            due tick. Its difference from the extrapolated pose fades with the time constant kLeadFade_s.
/// Limits  If the client itself leaves gaps between inputs (deadband), the delay grows by the length of the gaps.
/// Thread  room; time advances by one period per step; no allocation
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

  /// Stores a valid input that reached the room in the step at `now`. Discards it if it is not newer than the last
  /// input.
  void receive(const proto::ClientUpdate& update, Duration now) noexcept;
  /// Returns the input to use in the step at `now`, or nothing if no input has arrived. Call it exactly once per step.
  /// The first input is returned before its due time as well, so that the tool is held at the hand from the start.
  std::optional<PlayedInput> play(Duration now) noexcept;
  /// Extrapolates the input that play() has just returned with an underrun. If the hand has in fact stopped, the tool
  /// moves too far, by up to kRunOnMost_m. Use this function only where holding the tool would be worse. Holding would
  /// drop a shared object. It would also stop a carried object, and fling it when inputs arrive again.
  void run_on(PlayedInput& played) noexcept;
  /// Discards all inputs. The next input starts a new sequence.
  void reset() noexcept;

  /// Returns the delay at which inputs are played, minus the delay of the fastest input; 0 before the first input.
  Duration delay() const noexcept { return delay_.delay(); }

 private:
  const PlayedInput& input(std::size_t age) const noexcept;  ///< input by age; 0: the newest
  double ticks_per_second() const noexcept;
  double ticks_until(Duration client_time) const noexcept;
  void choose_tick(double wanted) noexcept;
  void lead(PlayedInput& played) noexcept;
  PlayedInput at_tick(std::uint64_t tick) const noexcept;

  double step_s_;
  std::array<PlayedInput, kHistory> inputs_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  std::uint64_t played_ = 0;        ///< last played tick; 0: none yet
  std::uint32_t steps_behind_ = 0;  ///< consecutive steps in which the played tick was behind the wanted one
  double underrun_s_ = 0;
  bool has_run_on_ = false;
  std::uint64_t due_ = 0;         ///< tick that should be played now, received or not
  std::uint64_t ran_to_ = 0;      ///< last tick to which run_on() has extrapolated; 0: run_on() was never called
  Vec3 lead_ = Vec3::Zero();      ///< offset of the played position from the position in the input, caused by run_on()
  Vec3 played_p_ = Vec3::Zero();  ///< last played position, including lead_

  net::PlayoutDelay delay_{kDelay};
};

}  // namespace tandem::server
