#include "client/model/grasp_prediction.hpp"

namespace tandem::client {
namespace {

/// Number of inputs (ticks) after a change of the button within which the server has granted or refused the grasp.
constexpr std::uint64_t kGraspAnsweredAfter = 5;

}  // namespace

bool GraspPrediction::follow_button(bool is_down, Tick input, LocalTime now, physics::World& world,
                                    std::size_t tool) noexcept {
  if (is_down == is_down_) return false;
  is_down_ = is_down;
  predicted_ = input;
  predicted_at_ = now;
  const BodyId before = world.tool(tool).held;
  if (is_down) {
    world.grab(tool, BodyId{});
  } else {
    world.release(tool);
  }
  return world.tool(tool).held != before;
}

// Returns true while the prediction applies instead of the server's result. The server's result counts only if both
// conditions hold:
// 1. The server has received an input that was sent after the change of the button. If inputs are lost, the server
//    extrapolates with the old buttons, so an answer to a later input is not sufficient.
// 2. The server has answered an input at least kGraspAnsweredAfter ticks after the change.
bool GraspPrediction::remains(const proto::ServerUpdate& update) const noexcept {
  if (!predicted_) return false;
  const bool has_received_button = update.echoed_sent == LocalTime{} || update.echoed_sent >= predicted_at_;
  return !has_received_button || update.answered_input.value < predicted_->value + kGraspAnsweredAfter;
}

bool GraspPrediction::mirror(const proto::ServerUpdate& update, const Pose& X_WT, double grip_step_m,
                             physics::World& world, std::size_t tool) noexcept {
  if (remains(update)) return false;
  predicted_.reset();
  const BodyId held = world.tool(tool).held;
  if (held == update.held_body) {
    if (held.is_valid()) world.move_grip(tool, update.X_BT, grip_step_m);
    return false;
  }
  if (update.held_body.is_valid()) {
    // The body is first held at its current pose relative to the tool, so that it does not jump. Later calls of
    // mirror() move the grip slowly to the server's grip.
    world.hold(tool, update.held_body, world.body(update.held_body).X.inverse() * X_WT);
  } else {
    world.release(tool);
  }
  return true;
}

}  // namespace tandem::client
