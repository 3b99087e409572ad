// Adaptive coupling law: stiffness and damping for a tool of a given mass on a calibrated device.
#pragma once

#include <array>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Cubic polynomial c₀ + c₁ x + c₂ x² + c₃ x³.
struct Cubic {
  std::array<double, 4> c{};
  double operator()(double x) const noexcept { return c[0] + x * (c[1] + x * (c[2] + x * c[3])); }
};

/// Limits of an adaptive fit: of its masses, inertias and polynomial coefficients, and of the stiffness and damping
/// that it returns. They are checked when a fit is read from a device profile or a scene, and when server or client
/// receives one (proto/coupling_fields.hpp).
inline constexpr double kMaxFitMass_kg = 1e4;
inline constexpr double kMaxFitInertia_kg_m2 = 1e4;
inline constexpr double kMaxFitPolynomial = 1e15;  ///< limit on the magnitude of a polynomial coefficient
inline constexpr double kMaxFitStiffness_n_per_m = 1e5;
inline constexpr double kMaxFitDamping_n_s_per_m = 1e4;
inline constexpr double kMaxFitStiffness_n_m_per_rad = 1e4;
inline constexpr double kMaxFitDamping_n_m_s_per_rad = 1e3;
/// Number of intervals into which a range of masses or stiffnesses is divided, to check the cubic's values in between.
/// A cubic has at most two turning points, so we consider 64 intervals sufficient.
inline constexpr int kFitSamples = 64;

/// Result of the calibration of one device (tandem-lab calibrate). A mass or inertia outside the calibrated range is
/// clamped to the nearest end of that range.
struct AdaptiveFit {
  double mass_low_kg = 0;
  double mass_high_kg = 0;
  Cubic stiffness_n_per_m;  ///< function of the mass [kg]
  Cubic damping_n_s_per_m;  ///< function of the stiffness [N/m]
  double inertia_low_kg_m2 = 0;
  double inertia_high_kg_m2 = 0;
  Cubic stiffness_n_m_per_rad;  ///< function of the inertia [kg·m²]
  Cubic damping_n_m_s_per_rad;  ///< function of the stiffness [N·m/rad]
};

/// Returns `base` with stiffness and damping replaced by the fit's values for a tool of this mass and moment of inertia
/// (mean of the principal moments). If the fit has no rotational range (inertia_high is 0), rotational stiffness and
/// damping are unchanged.
///
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 5.1–5.16
CouplingParameters adapted(const AdaptiveFit& fit, double mass_kg, double inertia_kg_m2,
                           const CouplingParameters& base) noexcept;

/// Returns the fit that the thesis gives for its Phantom Premium 1.5/6DOF, for masses of 0.05 to 0.2 kg. Stiffness =
/// 116.53 N/m per kg × mass + 16.21 N/m; damping = 0.2 N·s/m. The fit serves for comparison only, because it is too
/// soft: the weight of a 0.2 kg tool stretches the spring by 50 mm.
AdaptiveFit thesis_adaptive_fit() noexcept;

}  // namespace tandem::haptics
