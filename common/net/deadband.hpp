// Perceptual deadband: suppresses messages whose change is too small to be felt.
#pragma once

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

/// Maximum interval between messages, however small the change and the capacity of the link: 100 Hz. It limits the
/// effect of a lost message.
inline constexpr Duration kDeadbandFloor = std::chrono::milliseconds(10);
inline constexpr double kMaxDeadband = 0.5;

/// Detects changes that a user would feel, as a share of the present value (Weber's law).
///
/// Model   A force counts as changed if it differs from the receiver's by more than w · max(|F|, kForceFloor_n); a
///         velocity likewise. A position counts as changed if the deviation from the receiver's estimate, times the
///         coupling stiffness, exceeds the threshold of the present force. Torque and rotation follow the same rules.
/// Source  Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
///         data in telepresence and teleaction systems", IEEE Trans. Signal Processing 56(2), 2008: Weber's deadband on
///         forces and velocities. Positions and the floors of small values are ours. Without floors, noise at rest
///         would be sent; below them the just-noticeable share of a force rises.
/// In      weber_fraction  w, 0..kMaxDeadband; 0: every change is significant. About 0.1 for hands
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
  /// In      X_believed  the receiver's estimate now: the last sent pose, possibly extrapolated with the sent velocity
  ///         felt        force at the hand now
  ///         stiffness_…  of the coupling; converts displacements to forces, so that thresholds are in felt force
  bool notices(const RigidState& now, const Twist& sent, const Pose& X_believed, const Wrench& felt,
               double stiffness_n_per_m, double stiffness_n_m_per_rad) const;

 private:
  bool differs(const Vec3& a, const Vec3& b, double floor) const;

  double fraction_;
};

}  // namespace tandem::net
