// The user's grasp in the local model. It is predicted when the button changes, until the server's result for this
// change has arrived.
#pragma once

#include <cstdint>
#include <optional>

#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "common/physics/world.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Predicts grasps and releases of this user's tool.
///
/// Invariants  A predicted grasp or release applies until the server has received the changed button and has answered
///             an input at least 5 ticks later. From then on, the server's result applies
/// Thread      haptic: no allocation, no throw. Both functions return true if the grasp has changed; the model then
///             jumps, so the caller must blend the displayed force
class GraspPrediction {
 public:
  /// Predicts a grasp or release if the button has changed, by the rule that the server applies to this input.
  bool follow_button(bool is_down, Tick input, LocalTime now, physics::World& world, std::size_t tool) noexcept;
  /// Applies the server's result, unless a prediction applies. If model and server agree on the held body but not on
  /// its grip point, moves the model's grip point slowly to that of the server.
  /// In      X_WT         pose of the tool after the last step
  ///         grip_step_m  maximum motion of the grip point in this call
  bool mirror(const proto::ServerUpdate& update, const Pose& X_WT, double grip_step_m, physics::World& world,
              std::size_t tool) noexcept;

 private:
  bool remains(const proto::ServerUpdate& update) const noexcept;

  bool is_down_ = false;           ///< state of the button at the last input with a handle
  std::optional<Tick> predicted_;  ///< tick of the predicted grasp or release; empty if no prediction applies
  LocalTime predicted_at_{};
};

}  // namespace tandem::client
