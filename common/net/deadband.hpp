// Perceptual deadband: suppresses messages whose content has changed too little to be felt.
#pragma once

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

/// Maximum interval between messages (100 Hz). It applies even if the content is unchanged or the link is slow, so that
/// a lost message is replaced after this time.
inline constexpr Duration kDeadbandFloor = std::chrono::milliseconds(10);
inline constexpr double kMaxDeadband = 0.5;

/// Detects changes that a user could feel, by Weber's law: the threshold is a fraction of the value itself.
///
/// Model   A force counts as changed if it differs from the last sent force F by more than w · max(|F|, kForceFloor_n),
///         with the Weber fraction w. Velocities are treated in the same way.
///         For a position, the deviation from the receiver's estimate is multiplied by the coupling stiffness, and
///         compared with the threshold of the current force.
///         Torques and rotations follow the same rules.
/// Source  Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
///         data in telepresence and teleaction systems", IEEE Trans. Signal Processing 56(2), 2008: Weber's deadband on
///         forces and velocities. The rule for positions and the floors are our additions. A floor is the smallest
///         magnitude that enters the threshold. Without floors, sensor noise at rest would be sent. At forces below the
///         floor, a just noticeable difference is a larger fraction of the force.
/// In      weber_fraction  w, 0..kMaxDeadband; with 0 every change counts. About 0.1 is suitable for human hands
/// Thread  any, one at a time
class Deadband {
 public:
  static constexpr double kForceFloor_n = 1.0;
  static constexpr double kTorqueFloor_n_m = 0.03;
  static constexpr double kSpeedFloor_m_per_s = 0.1;
  static constexpr double kTurnFloor_rad_per_s = 2.0;

  explicit Deadband(double weber_fraction) : fraction_(weber_fraction) {}

  bool is_off() const { return !(fraction_ > 0); }
  bool notices(const Wrench& now, const Wrench& sent) const;
  /// In      now         current pose and velocity
  ///         sent        last sent velocity
  ///         X_believed  pose that the receiver assumes now: the last sent pose, or its extrapolation by `sent`
  ///         felt        current force at the hand, which determines the threshold
  ///         stiffness_…  stiffness of the coupling, by which displacements are converted to forces
  bool notices(const RigidState& now, const Twist& sent, const Pose& X_believed, const Wrench& felt,
               double stiffness_n_per_m, double stiffness_n_m_per_rad) const;

 private:
  bool differs(const Vec3& a, const Vec3& b, double floor) const;

  double fraction_;
};

}  // namespace tandem::net
