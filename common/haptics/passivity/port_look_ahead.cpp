#include "common/haptics/passivity/port_look_ahead.hpp"

#include <algorithm>

namespace tandem::haptics {

void PortLookAhead::move_to(const Pose& X_W, double share) noexcept {
  moved_m_ = has_pose_ ? Vec3(share * (X_W.p - X_W_.p)) : Vec3::Zero();
  turned_rad_ = has_pose_ ? Vec3(share * rotation_vector(X_W.q * X_W_.q.conjugate())) : Vec3::Zero();
  step_m_ = moved_m_.norm();
  turn_rad_ = turned_rad_.norm();
  X_W_ = X_W;
  has_pose_ = true;
}

double PortLookAhead::max_work_j(const Wrench& held_W, double period_s) const noexcept {
  const double square = period_s * period_s;
  return held_W.f.norm() * (step_m_ + kMaxAcceleration_m_per_s2 * square) +
         held_W.t.norm() * (turn_rad_ + kMaxAcceleration_rad_per_s2 * square);
}

double next_passivity_gain(double gain, double needed_j, double available_j, double period_s) noexcept {
  constexpr double kRise_s = 0.05;
  const double risen = std::min(1.0, gain + period_s / kRise_s);
  return needed_j > available_j ? std::min(risen, available_j / needed_j) : risen;
}

}  // namespace tandem::haptics
