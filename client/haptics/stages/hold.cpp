// See hold.hpp.
#include "client/haptics/stages/hold.hpp"

namespace tandem::client {

StageOutput Hold::tick(const StageInput& input) noexcept {
  StageOutput output;
  if (input.newest != nullptr) output.wrench_on_hand_W = input.newest->update.wrench_on_hand_W;
  return output;
}

}  // namespace tandem::client
