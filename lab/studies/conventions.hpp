// Constants that all studies share: the lowest frequency that counts as vibration, and gravity.
#pragma once

namespace tandem::lab {

/// Frequency above which users perceive force components as buzz. Voluntary motion and tremor have lower frequencies.
inline constexpr double kVibration_hz = 30;

inline constexpr double kGravity_m_per_s2 = 9.81;
constexpr double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

}  // namespace tandem::lab
