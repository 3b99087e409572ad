// Clutching: while the button is down the tool stays and the hand moves back; neither edge makes a force step.
#pragma once

#include "common/spatial.hpp"
#include "proto/state.hpp"

namespace tandem {

/// Turns mapped handle states into clutched ones.
///
/// Model   X_WH = O · X_raw, with the offset O (translation in W, rotation applied on the right: see clutch.cpp) chosen
///         at release so that X_WH does not jump; while pressed X_WH is frozen and V_WH is zero
class Clutch {
 public:
  RigidState apply(const RigidState& raw_W, bool is_pressed) noexcept;
  void reset() noexcept;

 private:
  bool was_pressed_ = false;
  Pose frozen_;
  Vec3 offset_p_ = Vec3::Zero();
  Quat offset_q_ = Quat::Identity();
};

}  // namespace tandem
