// The server's end of a user's wave line (ClientMode::kWave): the coupling pulls the tool to a virtual handle, which
// the wave moves, and the coupling's answer becomes the wave back.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave_port.hpp"
#include "proto/state.hpp"

namespace tandem::server {

/// One user's. Per step: target() before the world's, settle() after it.
///
/// Model   WaveToolPort, with the coupling's stiffness and damping at rest for its implicit step; both ends keep
///         account, so a client that uses another impedance gets reflections, but no energy
/// Thread  room: no allocation, no throw; finite for anything that a client may send
class WaveHand {
 public:
  explicit WaveHand(const haptics::WaveImpedance& impedance = {}) : port_(impedance, haptics::WavePlayer::Settings{}) {}

  /// Where the coupling is to pull the tool to in the coming step, instead of the client's handle.
  /// In      newest  input of mode kWave with a valid handle; the same one again is not counted twice
  RigidState target(const proto::ClientUpdate& newest, const haptics::CouplingParameters& coupling,
                    double step_s) noexcept;
  /// After the step; `wrench_on_hand_W` is the coupling's, about target().
  void settle(const Wrench& wrench_on_hand_W, double step_s) noexcept { port_.settle(-wrench_on_hand_W, step_s); }
  /// For ServerUpdate::wave.
  const haptics::Wave& wave() const noexcept { return port_.sum_towards_hand(); }
  /// The user left, lost the hand for long, or changed the mode.
  void reset() noexcept { port_.reset(); }

 private:
  haptics::WaveToolPort port_;
};

}  // namespace tandem::server
