#include "client/haptics/stages/force_blend.hpp"
#include "client/haptics/stages/makers.hpp"
#include "client/model/local_model.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {
namespace {

/// Of the coupling's limits: what a residual may add.
constexpr double kResidualShare = 1.0 / 3;

LocalModelInput model_input(const StageInput& input) {
  LocalModelInput result;
  result.input = input.tick;
  result.now = input.now;
  result.handle = input.handle;
  result.buttons = input.buttons;
  result.newest = input.newest;
  result.is_new = input.is_new;
  result.coupling = *input.parameters;
  return result;
}

class LocalModelStage final : public Stage {
 public:
  /// In      predictor  one of predictor_names()
  explicit LocalModelStage(const std::string& predictor)
      : residual_(predictor == "none" ? nullptr : haptics::make_force_stream(predictor)) {}

  std::string_view name() const noexcept override { return "local-model"; }
  StageOutput tick(const StageInput& input) noexcept override;
  void reset() noexcept override;
  void service() noexcept override {
    if (residual_ != nullptr) residual_->fit();
  }

 private:
  Wrench predicted_residual(const StageInput& input) noexcept;

  std::unique_ptr<haptics::ForceStream> residual_;  ///< null: "none"
  ForceBlend blend_;
  Wrench before_;  ///< shown, without what fades
  bool was_local_ = false;
};

StageOutput LocalModelStage::tick(const StageInput& input) noexcept {
  blend_.advance(input.period_s);
  LocalModel* const model = input.newest == nullptr ? nullptr : input.local_model;
  StageOutput output;
  if (model == nullptr) {
    output = late_pose(input);
  } else {
    output.local_wrench_on_hand_W = model->step(model_input(input));
    const Wrench residual = predicted_residual(input);
    output.wrench_on_hand_W = output.local_wrench_on_hand_W + residual;
    output.is_predicting = residual_ != nullptr;
    output.mode = proto::ClientMode::kLocalModel;
    output.is_local = true;
    output.tool = model->tool();
    output.energy_from_local_j = -model->coupling_work_j();
    output.round_trip = model->loop_delay();
    output.has_watched_body = input.watched.is_valid();
    if (output.has_watched_body) output.watched_body = model->body(input.watched);
  }
  const bool has_jumped = model != nullptr && model->take_jump();
  if (has_jumped || output.is_local != was_local_) blend_.jump(before_, output.wrench_on_hand_W);
  was_local_ = output.is_local;
  before_ = output.wrench_on_hand_W;
  output.wrench_on_hand_W = blend_.apply(output.wrench_on_hand_W);
  return output;
}

Wrench LocalModelStage::predicted_residual(const StageInput& input) noexcept {
  if (residual_ == nullptr) return {};
  const LocalModel& model = *input.local_model;
  if (const auto newest = input.local_model->take_residual()) residual_->push(model.residual_of(), *newest);
  const Wrench predicted = residual_->at(input.now);
  return {clamped_to_length(predicted.f, kResidualShare * input.parameters->force_limit_n),
          clamped_to_length(predicted.t, kResidualShare * input.parameters->torque_limit_n_m)};
}

void LocalModelStage::reset() noexcept {
  if (residual_ != nullptr) residual_->reset();
  blend_.reset();
  before_ = {};
  was_local_ = false;
}

}  // namespace

std::unique_ptr<Stage> make_local_model_stage(const StageSettings& settings) {
  return std::make_unique<LocalModelStage>(settings.predictor);
}

}  // namespace tandem::client
