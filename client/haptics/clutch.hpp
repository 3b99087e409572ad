// Clutching: while the clutch button is pressed, the tool stays in place and the user moves the handle back into reach.
//
// While the clutch is pressed, no force is displayed. A force computed from the frozen handle would not change as the
// hand moves, so it could do unlimited work. The haptic core reports the pressed clutch to the safety chain
// (kSafetyClutched). After the press, the chain reduces the force to zero at 0.1 N/ms. After the release, it ramps the
// force up. So the velocity V_WH of the handle may jump at press and release without a force step.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Converts a handle state without the clutch (raw) to the handle state that the tool follows; both are in the world.
/// The clutch changes only the motion. The safety chain controls the force.
///
/// Model   p_WH = p_raw + o,  R_WH = R_raw O
///         o, O  offsets of position and rotation, set at the release of the clutch so that X_WH does not jump
///         While the clutch is pressed, X_WH is frozen and V_WH is zero. O is the right factor, so that a rotation of
///         the hand about a world axis rotates the tool about the same axis: w_WH = w_raw.
/// Thread  haptic
class Clutch {
 public:
  RigidState apply(const RigidState& raw_W, bool is_pressed) noexcept;
  bool is_pressed() const noexcept { return was_pressed_; }
  /// Resets the offsets, so that the handle returns to the pose given by the workspace mapping.
  void reset() noexcept;

 private:
  Pose clutched(const Pose& raw) const noexcept;

  bool was_pressed_ = false;
  Pose frozen_;
  Vec3 offset_p_ = Vec3::Zero();
  Quat offset_q_ = Quat::Identity();
};

}  // namespace tandem::client
