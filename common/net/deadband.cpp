#include "common/net/deadband.hpp"

#include <algorithm>

namespace tandem::net {

// Returns whether a and b differ noticeably. The comparison is negated so that a NaN counts as different.
bool Deadband::differs(const Vec3& a, const Vec3& b, double floor) const {
  return !((a - b).norm() <= fraction_ * std::max(b.norm(), floor));
}

bool Deadband::notices(const Wrench& now, const Wrench& sent) const {
  return is_off() || differs(now.f, sent.f, kForceFloor_n) || differs(now.t, sent.t, kTorqueFloor_n_m);
}

bool Deadband::notices(const RigidState& now, const Twist& sent, const Pose& X_believed, const Wrench& felt,
                       double stiffness_n_per_m, double stiffness_n_m_per_rad) const {
  if (is_off()) return true;
  if (differs(now.V.v, sent.v, kSpeedFloor_m_per_s) || differs(now.V.w, sent.w, kTurnFloor_rad_per_s)) return true;
  const double way_n = stiffness_n_per_m * (now.X.p - X_believed.p).norm();
  const double turn_n_m = stiffness_n_m_per_rad * rotation_vector(now.X.q * X_believed.q.conjugate()).norm();
  return !(way_n <= fraction_ * std::max(felt.f.norm(), kForceFloor_n) &&
           turn_n_m <= fraction_ * std::max(felt.t.norm(), kTorqueFloor_n_m));
}

}  // namespace tandem::net
