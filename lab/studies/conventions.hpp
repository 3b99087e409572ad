// Constants that all studies share: the lowest frequency that counts as vibration, and gravity.
#pragma once

namespace tandem::lab {

/// Voluntary motion and tremor have frequencies below this limit. Force components above it are perceived as buzz.
inline constexpr double kVibration_hz = 30;

inline constexpr double kGravity_m_per_s2 = 9.81;
constexpr double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

}  // namespace tandem::lab
