// Clutching: while the button is down the tool stays and the hand moves back.
//
// The frozen handle pulls the hand nowhere: a force computed from it would not change as the hand moves, so it could
// do any amount of work. The haptic core therefore tells the safety chain, which takes the force to zero by 0.1 N/ms
// from the press on and ramps it in after the release (kSafetyClutched); so the jump of V_WH at the edges is not felt.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Turns mapped handle states into clutched ones. Positions only; the force is the safety chain's.
///
/// Model   p_WH = p_raw + o,  R_WH = R_raw · O. Both offsets are chosen at release so that X_WH does not jump; while
///         pressed X_WH is frozen and V_WH is zero. The rotation offset stands on the right, so that turning the
///         hand about a world axis still turns the tool about that axis: w_WH = w_raw.
/// Thread  haptic
class Clutch {
 public:
  RigidState apply(const RigidState& raw_W, bool is_pressed) noexcept;
  bool is_pressed() const noexcept { return was_pressed_; }
  /// Forgets the offsets: the handle is where the workspace mapping puts it.
  void reset() noexcept;

 private:
  Pose clutched(const Pose& raw) const noexcept;

  bool was_pressed_ = false;
  Pose frozen_;
  Vec3 offset_p_ = Vec3::Zero();
  Quat offset_q_ = Quat::Identity();
};

}  // namespace tandem::client
