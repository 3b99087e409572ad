#include "client/model/grasp_prediction.hpp"

namespace tandem::client {
namespace {

/// Number of inputs from a change of the button until the server has granted or refused the grasp.
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

// Returns whether the prediction remains valid. After a gap, the server may answer an input that it has extrapolated
// with the old buttons. So an answer counts only if the server has also received an input sent after the change of the
// button.
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
    // The body is held at its current pose relative to the tool, so that it does not jump. Later calls move the grip
    // slowly to the server's grip.
    world.hold(tool, update.held_body, world.body(update.held_body).X.inverse() * X_WT);
  } else {
    world.release(tool);
  }
  return true;
}

}  // namespace tandem::client
