#include "server/tick_faults.hpp"

#include <array>
#include <utility>

namespace tandem {

std::string describe_faults(TickFaults faults) {
  static constexpr std::array<std::pair<TickFault, const char*>, 6> kNames{{
      {kFaultNotFinite, "not_finite"},
      {kFaultSpeedLimited, "speed_limited"},
      {kFaultCouplingSaturated, "coupling_saturated"},
      {kFaultFieldLimited, "field_limited"},
      {kFaultInputStale, "input_stale"},
      {kFaultOverrun, "overrun"},
  }};
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if ((faults & bit) == 0) continue;
    if (!text.empty()) text += '|';
    text += name;
    faults &= ~static_cast<TickFaults>(bit);
  }
  // A newer server may send bits that this program does not know: they are shown, not hidden.
  if (faults != 0) text += (text.empty() ? "unknown_" : "|unknown_") + std::to_string(faults);
  return text.empty() ? "none" : text;
}

}  // namespace tandem
