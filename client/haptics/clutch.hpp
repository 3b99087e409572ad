// Clutching: while the button is down the tool stays and the hand moves back.
//
// The frozen handle exerts no force on the hand. A force computed from it would not change as the hand moves, so it
// could do unlimited work. The haptic core reports the clutch to the safety chain (kSafetyClutched). The chain reduces
// the force to zero by 0.1 N/ms from the press on and ramps it in after the release. Thus the jump of V_WH at both
// edges is not felt.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Turns mapped handle states into clutched ones. Positions only; the safety chain controls the force.
///
/// Model   p_WH = p_raw + o,  R_WH = R_raw · O. Both offsets are chosen at release so that X_WH does not jump; while
///         pressed X_WH is frozen and V_WH is zero. The rotation offset is the right factor, so that turning the
///         hand about a world axis still turns the tool about that axis: w_WH = w_raw.
/// Thread  haptic
class Clutch {
 public:
  RigidState apply(const RigidState& raw_W, bool is_pressed) noexcept;
  bool is_pressed() const noexcept { return was_pressed_; }
  /// Resets the offsets: the handle is again at the pose that the workspace mapping gives.
  void reset() noexcept;

 private:
  Pose clutched(const Pose& raw) const noexcept;

  bool was_pressed_ = false;
  Pose frozen_;
  Vec3 offset_p_ = Vec3::Zero();
  Quat offset_q_ = Quat::Identity();
};

}  // namespace tandem::client
