// Shared conventions of the studies: the frequency limit of vibration, and weight.
#pragma once

namespace tandem::lab {

/// Voluntary motion and tremor are below this frequency; force components above it are felt as buzz.
inline constexpr double kVibration_hz = 30;

inline constexpr double kGravity_m_per_s2 = 9.81;
constexpr double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

}  // namespace tandem::lab
