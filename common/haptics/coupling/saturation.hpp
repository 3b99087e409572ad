// Smooth saturation of a coupling force: small forces are unchanged, large ones approach the limit, without a corner in
// the curve.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Returns the saturated magnitude.
/// Model   H(F) = F up to the knee (1 − ε) F_max. Above the knee H(F) = F_max (1 − ε exp(−(F − (1−ε) F_max) / (ε
///         F_max))). H is increasing, has a continuous slope, and approaches F_max. For ε = 0 it is a clamp
/// Source  Hou, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, eqs. 5.10–5.12. The thesis
///         describes the properties of H; the exponential form is ours
/// In      magnitude ≥ 0 [any unit], limit > 0 in the same unit, softness ε from 0 to 1
double saturated(double magnitude, double limit, double softness) noexcept;
/// Returns dH/dF, which falls from 1 to 0.
double saturation_slope(double magnitude, double limit, double softness) noexcept;

/// Returns `a` with its length saturated and its direction unchanged. The result is finite for huge components, and
/// zero if `a` is not finite.
Vec3 saturated(const Vec3& a, double limit, double softness) noexcept;
/// Returns the derivative with respect to `a`: H' ââᵀ + H/|a| (I − ââᵀ), symmetric, eigenvalues from 0 to 1. Returns
/// zero if `a` is not finite.
Eigen::Matrix3d saturation_gradient(const Vec3& a, double limit, double softness) noexcept;

}  // namespace tandem::haptics
