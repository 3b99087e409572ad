// What the studies agree on: what counts as vibration, and what a mass weighs.
#pragma once

namespace tandem::lab {

/// Hands move below it, tremor included; what is above is felt as buzz.
inline constexpr double kVibration_hz = 30;

inline constexpr double kGravity_m_per_s2 = 9.81;
constexpr double weight_n(double mass_kg) {
  return mass_kg * kGravity_m_per_s2;
}

}  // namespace tandem::lab
