#include "common/haptics/coupling/radial.hpp"

#include <limits>

namespace tandem::haptics {

Polar polar(const Vec3& a) noexcept {
  const double largest = a.cwiseAbs().maxCoeff();
  if (!a.allFinite() || !(largest > 0)) return {};
  // The vector is scaled first, so that squares of large components do not overflow.
  const Vec3 scaled = a / largest;
  return {scaled.normalized(), std::min(scaled.norm() * largest, std::numeric_limits<double>::max())};
}

Eigen::Matrix3d radial_gradient(const Vec3& direction, const RadialStiffness& stiffness) noexcept {
  return stiffness.secant * Eigen::Matrix3d::Identity() +
         (stiffness.slope - stiffness.secant) * direction * direction.transpose();
}

}  // namespace tandem::haptics
