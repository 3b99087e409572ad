// Common parts of tests in which a setting changes while a hand presses on the wall: times of the change, and functions
// of the displayed force.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

#include "lab/session/virtual_session.hpp"

namespace tandem::lab {

using Ticks = std::vector<TickSample>;

/// Times at which a setting is changed and changed back, in the experiment "wall" (14 s). In this experiment the hand
/// presses deeper from 5.1 s to 7.1 s, and rests from 9.6 s to 13.1 s.
struct Change {
  Duration there{};
  Duration back{};
};
inline constexpr Change kMoving{std::chrono::milliseconds(5500), std::chrono::milliseconds(6300)};
inline constexpr Change kStill{std::chrono::milliseconds(11'000), std::chrono::milliseconds(11'800)};

/// Returns the largest change of the force on the hand within one millisecond.
inline double largest_step_n(const Ticks& ticks, Duration from, Duration watched) {
  double largest = 0;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    if (ticks[k].time <= from || ticks[k].time > from + watched) continue;
    largest = std::max(largest, (ticks[k].displayed_D.f - ticks[k - 1].displayed_D.f).norm());
  }
  return largest;
}

/// Returns the force on the hand at `time`, or 0 after the last tick.
inline Vec3 force_at_n(const Ticks& ticks, Duration time) {
  const auto at = std::ranges::find_if(ticks, [time](const TickSample& tick) { return tick.time >= time; });
  return at == ticks.end() ? Vec3(Vec3::Zero()) : at->displayed_D.f;
}

}  // namespace tandem::lab
