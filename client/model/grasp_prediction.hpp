// The user's grasp in the local model: predicted when the button changes, until the server's result replaces the
// prediction.
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
/// Invariants  A predicted grasp or release remains until the server has received the button and has answered an input
///             at least 5 ticks later. From then on, the server's result applies
/// Thread  haptic: no allocation, no throw. Both functions return true if the grasp has changed, because the model
///             then jumps
class GraspPrediction {
 public:
  /// Predicts a grasp or release if the button has changed, by the rule that the server applies to this input.
  bool follow_button(bool is_down, Tick input, LocalTime now, physics::World& world, std::size_t tool) noexcept;
  /// Applies the server's result, unless a prediction remains. If the grip point differs from that of the server, moves
  /// it slowly to the server's grip point.
  /// In      X_WT         pose of the tool after the last step
  ///         grip_step_m  maximum motion of the grip point in this call
  bool mirror(const proto::ServerUpdate& update, const Pose& X_WT, double grip_step_m, physics::World& world,
              std::size_t tool) noexcept;

 private:
  bool remains(const proto::ServerUpdate& update) const noexcept;

  bool is_down_ = false;           ///< state of the button at the last input with a handle
  std::optional<Tick> predicted_;  ///< input of a predicted grasp or release that is still in effect
  LocalTime predicted_at_{};
};

}  // namespace tandem::client
