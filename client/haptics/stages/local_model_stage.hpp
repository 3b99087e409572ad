// "local-model": the hand touches the client's own piece of the world (client/model); what the server knows beyond it
// may be predicted on top.
#pragma once

#include <memory>

#include "client/haptics/stages/force_blend.hpp"
#include "client/haptics/stages/late_pose.hpp"
#include "client/haptics/stages/stage.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {

/// Shows the local model's coupling.
///
/// Model   wrench = local model + r̂, r the server's wrench less the model's at the same input, continued over its age
///         by the predictor, and bounded by a third of the coupling's limits: it may tell of other hands and of what
///         the model lacks, but a contact that is only late must not push twice. With a joint it is left out: the joint
///         is how the other hand is felt. Without a local model (its assets are not all here yet): "late-pose".
/// Limits  r̂ closes a loop over the network as "hold" does, with the model's error as its gain
class LocalModelStage final : public Stage {
 public:
  /// In      predictor  one of predictor_names()
  explicit LocalModelStage(const std::string& predictor);

  std::string_view name() const noexcept override { return "local-model"; }
  StageOutput tick(const StageInput& input) noexcept override;
  void reset() noexcept override;
  void service() noexcept override;

 private:
  Wrench predicted_residual(const StageInput& input) noexcept;

  LatePose without_model_;
  std::unique_ptr<haptics::ForceStream> residual_;  ///< null: "none"
  ForceBlend blend_;
  Wrench before_;  ///< shown, without what fades
  bool was_local_ = false;
};

}  // namespace tandem::client
