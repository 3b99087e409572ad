#include "client/haptics/stages/makers.hpp"
#include "common/haptics/wave/wave_port.hpp"

namespace tandem::client {
namespace {

class WaveStage final : public Stage {
 public:
  explicit WaveStage(const haptics::WaveImpedance& impedance) : port_(impedance, haptics::WavePlayer::Settings{}) {}
  std::string_view name() const noexcept override { return "wave"; }

  StageOutput tick(const StageInput& input) noexcept override {
    StageOutput output;
    output.mode = proto::ClientMode::kWave;
    if (input.newest == nullptr) return output;
    // The stage is not ticked while samples are invalid. The motion of the hand during such a gap must not count as a
    // velocity.
    if (input.tick.value != last_tick_.value + 1) port_.lose_hand();
    last_tick_ = input.tick;
    if (input.is_new) port_.receive(input.newest->update.stepped.time_since_epoch(), input.newest->update.wave);
    output.wrench_on_hand_W = port_.tick(input.handle.X, input.period_s);
    output.wave = port_.sum_towards_tool();
    return output;
  }
  void set_displayed(const Wrench& on_hand_W) noexcept override { port_.set_displayed(on_hand_W); }
  void reset() noexcept override { port_.reset(); }

 private:
  haptics::WaveHandPort port_;
  Tick last_tick_;
};

}  // namespace

std::unique_ptr<Stage> make_wave_stage(const StageSettings& settings) {
  return haptics::is_usable(settings.wave) ? std::make_unique<WaveStage>(settings.wave) : nullptr;
}

}  // namespace tandem::client
