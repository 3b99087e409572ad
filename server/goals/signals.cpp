#include "server/goals/signals.hpp"

#include <algorithm>

namespace tandem::server {

void advance(SignalStatus& signal, const PlannedSignal& planned) noexcept {
  if (signal.has_value) ++signal.age_steps;
  signal.is_fresh =
      signal.has_value && signal.age_steps <= planned.max_age_steps && signal.confidence >= planned.min_confidence;
  signal.state = 0;
  if (!signal.is_fresh) return;
  const auto found = std::ranges::find_if(planned.states,
                                          [&signal](const SignalRange& state) { return state.contains(signal.value); });
  if (found == planned.states.end()) return;
  signal.state = static_cast<std::uint8_t>(found - planned.states.begin() + 1);
}

void count_state(SignalStatus& signal) noexcept {
  if (signal.state == 0) return;
  ++signal.level_steps[signal.state - 1U];
  ++signal.steps[signal.state - 1U];
}

std::optional<std::size_t> dominant_state(const SignalStatus& signal, std::uint64_t level_steps,
                                          double share) noexcept {
  const double needed = share * static_cast<double>(level_steps);
  const auto most = std::ranges::max_element(signal.level_steps);
  if (static_cast<double>(*most) <= needed) return std::nullopt;
  return static_cast<std::size_t>(most - signal.level_steps.begin());
}

}  // namespace tandem::server
