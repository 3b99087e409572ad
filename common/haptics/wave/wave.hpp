// Wave variables: velocity and force as two waves, one each way, whose squares are power. A line that only delays them
// gives back no more energy than it got, whatever the delay.
#pragma once

#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// The impedance of the line between hand and tool: how much force goes with how much speed in a wave.
struct WaveImpedance {
  double linear_n_s_per_m = 10.0;       ///< b; also the drag felt until the first echo. Higher: stiffer, but heavier
  double angular_n_m_s_per_rad = 0.01;  ///< its rotational twin

  bool operator==(const WaveImpedance&) const = default;
};
/// Both are finite and above 0, and no square root of them overflows.
inline bool is_usable(const WaveImpedance& b) {
  constexpr double kLeast = 1e-9, kMost = 1e9;
  return b.linear_n_s_per_m >= kLeast && b.linear_n_s_per_m <= kMost && b.angular_n_m_s_per_rad >= kLeast &&
         b.angular_n_m_s_per_rad <= kMost;
}

/// Six wave variables [√W], or their integral over time [√W·s]: `f` of translation, `t` of rotation.
using Wave = Wrench;

/// |a|² of all six.
inline double squared(const Wave& a) {
  return a.f.squaredNorm() + a.t.squaredNorm();
}

/// What goes with velocity `V` and the wrench `F` that the hand's side does on the tool's.
///
/// Model   towards the tool u = (b V + F) / √(2b), towards the hand v = (b V − F) / √(2b); ½u² − ½v² = F·V.
///         Back: V = (u + v) / √(2b), F = √(b/2) (u − v).
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
