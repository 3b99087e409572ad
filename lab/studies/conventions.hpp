// Constants that all studies share: the lowest frequency that counts as vibration, and gravity.
#pragma once

namespace tandem::lab {

/// Upper limit of the frequencies of voluntary motion and tremor. Users perceive force components above it as buzz.
inline constexpr double kVibration_hz = 30;

inline constexpr double kGravity_m_per_s2 = 9.81;
constexpr double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

}  // namespace tandem::lab
