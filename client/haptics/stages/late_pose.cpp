#include "client/haptics/stages/makers.hpp"

namespace tandem::client {
namespace {

class LatePose final : public Stage {
 public:
  std::string_view name() const noexcept override { return "late-pose"; }
  StageOutput tick(const StageInput& input) noexcept override { return late_pose(input); }
};

}  // namespace

std::unique_ptr<Stage> make_late_pose_stage(const StageSettings&) {
  return std::make_unique<LatePose>();
}

StageOutput late_pose(const StageInput& input) noexcept {
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
