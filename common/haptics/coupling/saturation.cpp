#include "common/haptics/coupling/saturation.hpp"

#include "common/haptics/coupling/radial.hpp"

namespace tandem::haptics {

double saturated(double magnitude, double limit, double softness) noexcept {
  const double knee = (1 - softness) * limit;
  if (magnitude <= knee) return magnitude;
  if (softness <= 0) return limit;
  return limit * (1 - softness * std::exp(-(magnitude - knee) / (softness * limit)));
}

double saturation_slope(double magnitude, double limit, double softness) noexcept {
  const double knee = (1 - softness) * limit;
  if (magnitude <= knee) return 1;
  if (softness <= 0) return 0;
  return std::exp(-(magnitude - knee) / (softness * limit));
}

Vec3 saturated(const Vec3& a, double limit, double softness) noexcept {
  const Polar p = polar(a);
  if (p.length <= (1 - softness) * limit) return p.length > 0 ? a : Vec3::Zero();
  return p.direction * saturated(p.length, limit, softness);
}

Eigen::Matrix3d saturation_gradient(const Vec3& a, double limit, double softness) noexcept {
  if (!a.allFinite()) return Eigen::Matrix3d::Zero();
  const Polar p = polar(a);
  if (p.length <= (1 - softness) * limit) return Eigen::Matrix3d::Identity();
  return radial_gradient(
      p.direction, {saturated(p.length, limit, softness) / p.length, saturation_slope(p.length, limit, softness)});
}

}  // namespace tandem::haptics
