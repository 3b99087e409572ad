// Forces along a displacement: every elastic part, and the saturation after it, is a magnitude of a length along one
// direction. What they share: a length that does not overflow, and the derivative of such a force.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// A vector as direction and length; both zero for what is zero or not finite. The length is at most the largest
/// double, also where the squares of the components overflow.
struct Polar {
  Vec3 direction = Vec3::Zero();
  double length = 0;
};
Polar polar(const Vec3& a) noexcept;

/// How steep a magnitude f(x) is at one length x: its force is secant · vector.
struct RadialStiffness {
  double secant = 0;  ///< f(x)/x; at 0 its limit, f'(0)
  double slope = 0;   ///< f'(x)
};

/// Derivative of secant · a by a, for |a| along `direction`.
///
/// Model   f' ââᵀ + f/x (I − ââᵀ): symmetric, eigenvalues slope once and secant twice
Eigen::Matrix3d radial_gradient(const Vec3& direction, const RadialStiffness& stiffness) noexcept;

}  // namespace tandem::haptics
