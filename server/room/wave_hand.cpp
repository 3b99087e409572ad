#include "server/room/wave_hand.hpp"

namespace tandem::server {

RigidState WaveHand::target(const proto::ClientUpdate& newest, const haptics::CouplingParameters& coupling,
                            double step_s) noexcept {
  port_.receive(newest.sent.time_since_epoch(), newest.wave);
  const Pose& X = port_.move(newest.handle.X, coupling, step_s);
  return {X, port_.velocity()};
}

}  // namespace tandem::server
