// "wave": force and velocity travel as wave variables (common/haptics/wave). Stable at any constant delay, at the price of a
// line that is felt: heavier in the air and softer in contact the longer it is.
#pragma once

#include "client/haptics/stages/stage.hpp"
#include "common/haptics/wave/wave_port.hpp"

namespace tandem::client {

class WaveStage final : public Stage {
 public:
  explicit WaveStage(const haptics::WaveImpedance& impedance) : port_(impedance, haptics::WavePlayer::Settings{}) {}
  std::string_view name() const noexcept override { return "wave"; }
  StageOutput tick(const StageInput& input) noexcept override;
  void set_displayed(const Wrench& on_hand_W) noexcept override { port_.set_displayed(on_hand_W); }
  void reset() noexcept override { port_.reset(); }

 private:
  haptics::WaveHandPort port_;
  Tick last_tick_;
};

}  // namespace tandem::client
