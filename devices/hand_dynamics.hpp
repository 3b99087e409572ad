// Motion of a simulated hand that follows an intended trajectory while the force of its device acts on it.
#pragma once

#include "common/base/spatial.hpp"
#include "devices/hand_parameters.hpp"

namespace tandem::devices {

/// The hand: a mass with a damper and a spring to the intended pose, with coefficients from HandParameters.
///
/// Model   leapfrog integration with steps of at most 0.1 ms. The damping is integrated exactly (as an exponential), so
///         that the integration is stable for any damping
class HandDynamics {
 public:
  static constexpr double kMaxStep_s = 1e-4;

  /// Starts the hand at rest at X_DH.
  /// Fails   std::invalid_argument: the message names the parameter, its value and the remedy
  HandDynamics(const HandParameters& hand, const Pose& X_DH);

  /// In      on_hand_D  wrench of the device on the hand
  ///         more_D     additional force on the hand
  ///         dt_s       time step, at most kMaxStep_s
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
