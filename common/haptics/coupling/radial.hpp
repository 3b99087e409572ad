// Radial forces: forces along a vector whose magnitude is a function of the vector's length, such as an elastic curve
// or a saturation. This file computes the length without overflow, and the derivative of such a force.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Direction and length of a vector; both are zero if the vector is zero or not finite. If the length overflows, it is
/// the largest finite double.
struct Polar {
  Vec3 direction = Vec3::Zero();
  double length = 0;
};
Polar polar(const Vec3& a) noexcept;

/// Stiffness of a force magnitude f(x) at one length x. The force vector is secant times the displacement vector.
struct RadialStiffness {
  double secant = 0;  ///< f(x)/x, with the limit f'(0) at x = 0
  double slope = 0;   ///< f'(x)
};

/// Returns the derivative of secant · a with respect to a, for an `a` along `direction`.
///
/// Model   f' ââᵀ + f/x (I − ââᵀ): symmetric; eigenvalues: slope (once) and secant (twice)
Eigen::Matrix3d radial_gradient(const Vec3& direction, const RadialStiffness& stiffness) noexcept;

}  // namespace tandem::haptics
