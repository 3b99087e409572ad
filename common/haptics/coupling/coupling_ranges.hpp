// Accepted range of each coupling coefficient that is received or read from a file. Within these ranges arithmetic does
// not overflow, and scenes from nanometres to rooms are possible (after workspace scaling). The ranges do not protect
// the user's hand: the limits of the device do that.
#pragma once

#include <array>
#include <cmath>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

struct CouplingRange {
  double CouplingParameters::*value;
  double low;
  double high;
};

inline constexpr std::array<CouplingRange, 8> kCouplingRanges{{
    {&CouplingParameters::stiffness_n_per_m, 0, 1e5},
    {&CouplingParameters::damping_n_s_per_m, 0, 1e4},
    {&CouplingParameters::stiffness_n_m_per_rad, 0, 1e4},
    {&CouplingParameters::damping_n_m_s_per_rad, 0, 1e3},
    {&CouplingParameters::force_limit_n, 1e-3, 1e3},
    {&CouplingParameters::torque_limit_n_m, 1e-3, 1e3},
    {&CouplingParameters::saturation_softness, 0, 1},
    {&CouplingParameters::curve_sharpness, 0.1, 10},
}};

/// Returns whether the coefficients are finite and not negative, as the laws require. Coefficients from a network or a
/// file must lie within kCouplingRanges, too.
inline bool is_usable(const CouplingParameters& parameters) {
  for (const CouplingRange& range : kCouplingRanges) {
    const double value = parameters.*range.value;
    if (!std::isfinite(value) || value < 0) return false;
  }
  return true;
}

}  // namespace tandem::haptics
