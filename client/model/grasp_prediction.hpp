// The user's grasp in the local model: predicted at the button, then replaced by the server's outcome.
#pragma once

#include <cstdint>
#include <optional>

#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "common/physics/world.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Grasps and releases of the user's own tool.
///
/// Invariants  A predicted grasp or release remains until the server has received the button and answered an input at
///             least 5 ticks later. After that, the server's outcome counts.
/// Thread      haptic: no allocation, no throw. Both calls return true if the grasp changed: the model jumped
class GraspPrediction {
 public:
  /// Grabs or releases at a change of the button, by the rule that the server applies to the same input.
  bool follow_button(bool is_down, Tick input, LocalTime now, physics::World& world, std::size_t tool) noexcept;
  /// Applies the server's outcome, unless a prediction remains. A grip at another place moves slowly to the server's.
  /// In      X_WT         pose of the tool after the last step
  ///         grip_step_m  limit of that motion
  bool mirror(const proto::ServerUpdate& update, const Pose& X_WT, double grip_step_m, physics::World& world,
              std::size_t tool) noexcept;

 private:
  bool remains(const proto::ServerUpdate& update) const noexcept;

  bool is_down_ = false;           ///< the button at the last input with a handle
  std::optional<Tick> predicted_;  ///< input of a predicted grasp or release that the server has not answered yet
  LocalTime predicted_at_{};
};

}  // namespace tandem::client
