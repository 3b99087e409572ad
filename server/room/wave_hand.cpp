#include "server/room/wave_hand.hpp"

namespace tandem::server {

RigidState WaveHand::target(const proto::ClientUpdate& newest, const haptics::CouplingParameters& coupling,
                            double step_s) noexcept {
  port_.receive(newest.sent.time_since_epoch(), newest.wave);
  const haptics::WaveToolPort::Coupling at_rest{coupling.stiffness_n_per_m, coupling.damping_n_s_per_m,
                                                coupling.stiffness_n_m_per_rad, coupling.damping_n_m_s_per_rad};
  const Pose& X = port_.move(newest.handle.X, at_rest, step_s);
  return {X, port_.velocity()};
}

}  // namespace tandem::server
