// How a hand moves that intends to be somewhere and is pushed by its device.
#pragma once

#include "common/base/spatial.hpp"
#include "devices/hand_parameters.hpp"

namespace tandem::devices {

/// The mass, damper and spring of HandParameters.
///
/// Model   exact enough: leapfrog, sub-steps ≤ 0.1 ms, damping as its exponential, so any is stable
class HandDynamics {
 public:
  static constexpr double kMaxStep_s = 1e-4;

  /// At rest at X_DH.
  /// Fails   std::invalid_argument naming the parameter, its value and what would do
  HandDynamics(const HandParameters& hand, const Pose& X_DH);

  /// In      on_hand_D, more_D  what pushes it; dt_s at most kMaxStep_s
  void advance(const Pose& intended, const Twist& intended_rate, const Wrench& on_hand_D, const Vec3& more_D,
               double dt_s) noexcept;
  const Pose& pose() const { return X_DH_; }
  const Twist& twist() const { return V_DH_; }

 private:
  HandParameters hand_;
  Pose X_DH_;
  Twist V_DH_;
};

}  // namespace tandem::devices
