// The elastic curves of the coupling laws, as magnitude against displacement, each for translation (N, m) and rotation
// (N·m, rad) alike.
//
//   force                                        k    stiffness
//   limit ┤            . - ‾ ‾ qsa               L    limit
//         │        . ‾   _ - ‾ stable dynamic    x    displacement, bends at L / k
//         │     .‾    ／                         u    k x / L
//         │   ／    ／
//       0 ┼─‾──__-‾──────────┬────── x
//         0                 L/k
#pragma once

#include "common/haptics/coupling/radial.hpp"

namespace tandem::haptics {

/// Model   f = k x
RadialStiffness linear_curve(double stiffness) noexcept;

/// Steepest at first, tired at the limit.
///
/// Model   f = L (1 − e^(−u)): slope k at 0
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 3.10–3.14, after Wan, McNeely, "Quasi-static approximation for 6 degrees-
///         of-freedom haptic rendering", IEEE Visualization 2003. Rotation: theirs has a moment arm R, θ_max = d_max/R
///         and k_r = 2 R² k_t (as far as the printed formula can be read); ours has k_r and T_max as parameters and
///         bends at θ_max = T_max/k_r. T_max = 2 R F_max with that k_r gives theirs; but a device's torque limit is
///         its own, and a tool's R would tie what the hand feels in rotation to the tool's size
/// In      displacement ≥ 0, limit > 0
RadialStiffness qsa_curve(double stiffness, double limit, double displacement) noexcept;

/// Flat at first, so that a light tool's jitter is not felt, then steep, then tired at the limit.
///
/// Model   f = L (1 − e^(−c u²)): slope 0 at 0, steepest √(2c/e) k = 0.86 √c k at u = 1/√(2c), f = 0.63 L at u = 1/√c
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 4.3, 4.7: the printed formula holds one 2, read as the exponent of u; as
///         a factor of u it would give no flat beginning, which the text describes. Both at once is c = 2
/// In      displacement ≥ 0, limit > 0, sharpness c
RadialStiffness stable_dynamic_curve(double stiffness, double limit, double sharpness, double displacement) noexcept;

}  // namespace tandem::haptics
