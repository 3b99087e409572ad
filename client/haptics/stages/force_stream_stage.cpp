// See force_stream_stage.hpp.
#include "client/haptics/stages/force_stream_stage.hpp"

namespace tandem::client {

bool ContactOnset::changes_with(const Wrench& wrench) noexcept {
  const double force_n = wrench.f.norm(), torque_n_m = wrench.t.norm();
  const bool was_touching = is_touching_;
  is_touching_ =
      was_touching ? force_n > kFree_n || torque_n_m > kFree_n_m : force_n > kTouching_n || torque_n_m > kTouching_n_m;
  return is_touching_ != was_touching;
}

StageOutput ForceStreamStage::tick(const StageInput& input) noexcept {
  StageOutput output;
  if (input.newest == nullptr) return output;
  if (input.is_new) {
    const Wrench& wrench = input.newest->update.wrench_on_hand_W;
    stream_.push(stepped_at(*input.newest), wrench, onset_.changes_with(wrench));
  }
  output.wrench_on_hand_W = stream_.at(input.now);
  output.is_predicting = true;
  return output;
}

void ForceStreamStage::reset() noexcept {
  stream_.reset();
  onset_.reset();
}

}  // namespace tandem::client
