// Work at the hand's port, where hand and device exchange energy, summed over a run.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Running sums of the work of a wrench that is held constant from tick to tick.
///
/// Model   w_k = F_k·(x_{k+1} − x_k) + τ_k·Δθ: work of tick k
///         F_k, τ_k  force and torque on the hand, constant during the tick
///         x_k       position of the hand at the start of the tick
///         Δθ        rotation of the hand during the tick
///         Positive w_k are summed as energy to the hand, and negative w_k as energy from the hand.
/// Thread  haptic: no allocation, no throw
class PortWork {
 public:
  /// Ends a period with the hand at `X`, and adds the work of the held wrench during the period.
  void move_to(const Pose& X) noexcept;
  /// Must be called if the hand's pose is unknown. The motion up to the next move_to() then adds no work.
  void lose_pose() noexcept { has_pose_ = false; }
  /// Sets the wrench about the handle for the following periods.
  void hold(const Wrench& on_hand) noexcept { held_ = on_hand; }

  double to_hand_j() const noexcept { return to_hand_j_; }
  double from_hand_j() const noexcept { return from_hand_j_; }  ///< energy from the hand, ≥ 0

 private:
  bool has_pose_ = false;
  Pose X_;
  Wrench held_;
  double to_hand_j_ = 0;
  double from_hand_j_ = 0;
};

}  // namespace tandem::client
