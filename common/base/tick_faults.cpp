#include "common/base/tick_faults.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace tandem {
namespace {

struct NamedFault {
  TickFault bit;
  std::string_view name;
};
/// Names of the faults, in the order of their bits.
constexpr std::array<NamedFault, kTickFaultBits> kNames{{
    {kFaultNotFinite, "not_finite"},
    {kFaultSpeedLimited, "speed_limited"},
    {kFaultCouplingSaturated, "coupling_saturated"},
    {kFaultFieldLimited, "field_limited"},
    {kFaultInputStale, "input_stale"},
    {kFaultOverrun, "overrun"},
    {kFaultContactUnsolved, "contact_unsolved"},
    {kFaultContactCoarse, "contact_coarse"},
    {kFaultSoftLate, "soft_late"},
    {kFaultToolEnergyLimited, "tool_energy_limited"},
    {kFaultRoomSlow, "room_slow"},
    {kFaultOutOfBounds, "out_of_bounds"},
}};

}  // namespace

std::vector<std::string> tick_fault_names(TickFaults faults) {
  std::vector<std::string> names;
  for (unsigned i = 0; i < 32; ++i) {
    const TickFaults bit = TickFaults{1} << i;
    if ((faults & bit) == 0) continue;
    const auto known =
        std::find_if(kNames.begin(), kNames.end(), [bit](const NamedFault& entry) { return entry.bit == bit; });
    names.push_back(known != kNames.end() ? std::string(known->name) : "bit_" + std::to_string(i));
  }
  return names;
}

std::string describe_faults(TickFaults faults) {
  std::string text;
  for (const std::string& name : tick_fault_names(faults)) text += (text.empty() ? "" : "|") + name;
  return text.empty() ? "none" : text;
}

}  // namespace tandem
