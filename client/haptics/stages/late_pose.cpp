// See late_pose.hpp.
#include "client/haptics/stages/late_pose.hpp"

namespace tandem::client {

StageOutput LatePose::tick(const StageInput& input) noexcept {
  StageOutput output;
  if (input.newest == nullptr) return output;
  const proto::ServerUpdate& newest = input.newest->update;
  if (input.coupling->tool_dynamics() == haptics::ToolDynamics::kAtHandle) {
    output.wrench_on_hand_W = newest.wrench_on_hand_W;
  } else {
    output.wrench_on_hand_W =
        haptics::coupling_wrenches(*input.coupling, input.handle.X, input.handle.V, newest.tool.X, newest.tool.V)
            .on_hand_W;
  }
  return output;
}

}  // namespace tandem::client
