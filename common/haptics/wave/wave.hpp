// Wave variables. Velocity and force are combined into two waves, one in each direction; half the square of a wave is
// its power. A line that only delays the waves returns no more energy than it received, for any delay.
#pragma once

#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Impedance of the transmission line between hand and tool: ratio of force to velocity in a wave.
struct WaveImpedance {
  /// Impedance b for translation. Until the first returning wave arrives, the hand feels b as damping. With a higher b,
  /// the line feels stiffer.
  double linear_n_s_per_m = 10.0;
  double angular_n_m_s_per_rad = 0.01;  ///< b for rotation

  bool operator==(const WaveImpedance&) const = default;
};
/// Returns whether both values are finite, above 0, and in a range in which products and square roots do not overflow.
inline bool is_usable(const WaveImpedance& b) {
  constexpr double kLeast = 1e-9, kMost = 1e9;
  return b.linear_n_s_per_m >= kLeast && b.linear_n_s_per_m <= kMost && b.angular_n_m_s_per_rad >= kLeast &&
         b.angular_n_m_s_per_rad <= kMost;
}

/// Six wave variables [√W], or their integral over time [√W·s]: `f` for translation, `t` for rotation.
using Wave = Wrench;

/// Returns |a|², the sum over all six components.
inline double squared(const Wave& a) {
  return a.f.squaredNorm() + a.t.squaredNorm();
}

/// Converts power variables to the wave towards the tool. The power variables are the velocity `V` of the line, and the
/// wrench `F` that the hand's side exerts on the tool's side.
///
/// Model   towards the tool u = (b V + F) / √(2b), towards the hand v = (b V − F) / √(2b); ½u² − ½v² = F·V.
///         Inverse: V = (u + v) / √(2b), F = √(b/2) (u − v).
/// Source  Niemeyer, Slotine, "Stable adaptive teleoperation", IEEE J. Oceanic Eng. 16(1), 1991
inline Wave wave_towards_tool(const WaveImpedance& b, const Twist& V, const Wrench& F) {
  const double l = b.linear_n_s_per_m, a = b.angular_n_m_s_per_rad;
  return {(l * V.v + F.f) / std::sqrt(2 * l), (a * V.w + F.t) / std::sqrt(2 * a)};
}
inline Wave wave_towards_hand(const WaveImpedance& b, const Twist& V, const Wrench& F) {
  return wave_towards_tool(b, V, -F);
}
inline Twist velocity_of_waves(const WaveImpedance& b, const Wave& towards_tool, const Wave& towards_hand) {
  const Wave sum = towards_tool + towards_hand;
  return {sum.f / std::sqrt(2 * b.linear_n_s_per_m), sum.t / std::sqrt(2 * b.angular_n_m_s_per_rad)};
}
inline Wrench wrench_of_waves(const WaveImpedance& b, const Wave& towards_tool, const Wave& towards_hand) {
  const Wave difference = towards_tool - towards_hand;
  return {difference.f * std::sqrt(b.linear_n_s_per_m / 2), difference.t * std::sqrt(b.angular_n_m_s_per_rad / 2)};
}

}  // namespace tandem::haptics
