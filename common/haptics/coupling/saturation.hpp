// Smooth saturation of a coupling force: the identity for small forces, bounded by the limit, without a corner.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Returns the magnitude after saturation.
///
/// Model   H(F) = F up to the knee (1 − ε) F_max; above, F_max (1 − ε exp(−(F − (1−ε) F_max) / (ε F_max))): C1, rising,
///         asymptotic to F_max. ε = 0: a clamp
/// Source  Hou, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, eqs. 5.10–5.12;
///         the exponential is our form of the described properties
/// In      magnitude ≥ 0 [any unit], limit > 0 in the same, softness ε in 0..1
double saturated(double magnitude, double limit, double softness) noexcept;
/// Returns dH/dF, from 1 to 0.
double saturation_slope(double magnitude, double limit, double softness) noexcept;

/// Returns `a` with its length saturated and its direction kept; finite for huge components, zero for non-finite ones.
Vec3 saturated(const Vec3& a, double limit, double softness) noexcept;
/// Returns the derivative by `a`: H' ââᵀ + H/|a| (I − ââᵀ), symmetric, eigenvalues 0..1. Zero for a non-finite `a`.
Eigen::Matrix3d saturation_gradient(const Vec3& a, double limit, double softness) noexcept;

}  // namespace tandem::haptics
