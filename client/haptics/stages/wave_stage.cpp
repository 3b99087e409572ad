// See wave_stage.hpp.
#include "client/haptics/stages/wave_stage.hpp"

namespace tandem::client {

StageOutput WaveStage::tick(const StageInput& input) noexcept {
  StageOutput output;
  output.mode = proto::ClientMode::kWave;
  if (input.newest == nullptr) return output;
  // Ticks without a hand are not told here: what it did meanwhile is not a velocity.
  if (input.tick.value != last_tick_.value + 1) port_.lose_hand();
  last_tick_ = input.tick;
  if (input.is_new) port_.receive(input.newest->update.stepped.time_since_epoch(), input.newest->update.wave);
  output.wrench_on_hand_W = port_.tick(input.handle.X, input.period_s);
  output.wave = port_.sum_towards_tool();
  return output;
}

}  // namespace tandem::client
