// Leaves out messages that nobody would notice: what has changed by less than a hand can tell need not be sent at once.
#pragma once

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::net {

/// However little changes, and however little a link carries, a message is sent this often, so that a lost one does no
/// harm for long: 100 Hz.
inline constexpr Duration kDeadbandFloor = std::chrono::milliseconds(10);
inline constexpr double kMaxDeadband = 0.5;

/// What is noticed, as a share of what there is (Weber).
///
/// Model   A force is noticed to be another one when it differs by more than w · max(|F|, kForceFloor_n) from the one
///         that the receiver has; a velocity likewise. A place, when it differs from where the receiver believes it by
///         more than would be noticed as force, |F| the present one and the coupling's stiffness. Rotation alike.
/// Source  Hinterseer, Hirche, Chaudhuri, Steinbach, Buss, "Perception-based data reduction and transmission of haptic
///         data in telepresence and teleaction systems", IEEE Trans. Signal Processing 56(2), 2008: Weber's deadband on
///         forces and velocities. Places and the floors of small values are ours: without floors noise at rest would be
///         sent; they are where the share of force that hands tell apart begins to rise.
/// In      weber_fraction  w, 0..kMaxDeadband; 0: everything is noticed. About 0.1 for hands
/// Thread  any, one at a time
class Deadband {
 public:
  static constexpr double kForceFloor_n = 1.0;
  static constexpr double kTorqueFloor_n_m = 0.03;
  static constexpr double kSpeedFloor_m_per_s = 0.1;
  static constexpr double kTurnFloor_rad_per_s = 2.0;

  explicit Deadband(double weber_fraction) : fraction_(weber_fraction) {}

  bool is_off() const { return !(fraction_ > 0); }
  bool notices(const Wrench& now, const Wrench& told) const;
  /// In      X_believed  where the receiver has it now: where it was told, or on from there with the told velocity
  ///         felt  what the hand feels now
  ///         stiffness_…  of the coupling that makes a force of a way, so that places are compared by what is felt
  bool notices(const RigidState& now, const Twist& told, const Pose& X_believed, const Wrench& felt,
               double stiffness_n_per_m, double stiffness_n_m_per_rad) const;

 private:
  bool differs(const Vec3& a, const Vec3& b, double floor) const;

  double fraction_;
};

}  // namespace tandem::net
