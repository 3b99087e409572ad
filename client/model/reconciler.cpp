#include "client/model/reconciler.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

Vec3 beyond(const Vec3& value, double dead_zone) {
  const double length = value.norm();
  return length > dead_zone ? Vec3(value * (1 - dead_zone / length)) : Vec3(Vec3::Zero());
}

bool is_finite(const Shift& shift) {
  return tandem::is_finite(shift.p) && tandem::is_finite(shift.theta) && tandem::is_finite(shift.v) &&
         tandem::is_finite(shift.w);
}

}  // namespace

Shift shift_between(const RigidState& from, const RigidState& to) noexcept {
  return {to.X.p - from.X.p, rotation_vector(to.X.q * from.X.q.conjugate()), to.V.v - from.V.v, to.V.w - from.V.w};
}

void Reconciler::observe(const RigidState& server, const RigidState& then, const Shift& given_then) noexcept {
  Shift error = shift_between(then, server);
  if (!is_finite(error)) return;
  error_m_ = error.p.norm();
  error.p = beyond(error.p, settings_.dead_zone_m);
  error.theta = beyond(error.theta, settings_.dead_zone_rad);
  wanted_ = given_then + error;
}

Shift Reconciler::step(double period_s, double loop_s) noexcept {
  const double time_constant_s = settings_.time_constant_s + settings_.loops * loop_s;
  const double part = std::min(1.0, period_s / time_constant_s);
  Shift shift = (wanted_ - given_) * part;
  shift.p = clamped_to_length(shift.p, settings_.speed_limit_m_per_s * period_s);
  shift.theta = clamped_to_length(shift.theta, settings_.turn_limit_rad_per_s * period_s);
  // Per tick, the correction of the velocity is at most the speed limit times the fraction `part`.
  shift.v = clamped_to_length(shift.v, settings_.speed_limit_m_per_s * part);
  shift.w = clamped_to_length(shift.w, settings_.turn_limit_rad_per_s * part);
  given_ = given_ + shift;
  return shift;
}

}  // namespace tandem::client
