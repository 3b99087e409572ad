#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

bool limit_motion(Twist& V_WC, double radius_m, double speed_m_per_s) noexcept {
  const double fastest = V_WC.v.norm() + V_WC.w.norm() * radius_m;
  if (!(fastest > speed_m_per_s)) return false;
  V_WC.v *= speed_m_per_s / fastest;
  V_WC.w *= speed_m_per_s / fastest;
  return true;
}

void TouchDrag::add(const TouchDrag& more) noexcept {
  const auto mix = [](Vec3& mean, double& sum, const Vec3& value, double weight) {
    sum += weight;
    if (sum > 0) mean += weight / sum * (value - mean);
  };
  mix(V_W.v, fluid.damping_n_s_per_m, more.V_W.v, more.fluid.damping_n_s_per_m);
  mix(V_W.w, fluid.damping_n_m_s_per_rad, more.V_W.w, more.fluid.damping_n_m_s_per_rad);
  force_limit_n += more.force_limit_n;
  torque_limit_n_m += more.torque_limit_n_m;
}

}  // namespace tandem::physics
