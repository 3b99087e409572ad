// Forces along a displacement: each elastic part and the saturation map a length to a magnitude along one direction.
// This file has their common parts: a length that does not overflow, and the derivative of such a force.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// A vector as direction and length; both zero for a vector that is zero or not finite. The length is clamped to the
/// largest double where it overflows.
struct Polar {
  Vec3 direction = Vec3::Zero();
  double length = 0;
};
Polar polar(const Vec3& a) noexcept;

/// Stiffness of a magnitude f(x) at one length x; the force is secant · vector.
struct RadialStiffness {
  double secant = 0;  ///< f(x)/x; at 0 its limit, f'(0)
  double slope = 0;   ///< f'(x)
};

/// Derivative of secant · a by a, for |a| along `direction`.
///
/// Model   f' ââᵀ + f/x (I − ââᵀ): symmetric, eigenvalues slope once and secant twice
Eigen::Matrix3d radial_gradient(const Vec3& direction, const RadialStiffness& stiffness) noexcept;

}  // namespace tandem::haptics
