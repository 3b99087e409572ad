#include "common/base/tick_faults.hpp"

#include <algorithm>

namespace tandem {

std::vector<std::string> tick_fault_names(TickFaults faults) {
  std::vector<std::string> names;
  for (unsigned i = 0; i < 32; ++i) {
    const TickFaults bit = TickFaults{1} << i;
    if ((faults & bit) == 0) continue;
    const auto known = std::find_if(kTickFaultNames.begin(), kTickFaultNames.end(),
                                    [bit](const TickFaultName& entry) { return entry.bit == bit; });
    names.push_back(known != kTickFaultNames.end() ? std::string(known->name) : "bit_" + std::to_string(i));
  }
  return names;
}

std::string describe_faults(TickFaults faults) {
  std::string text;
  for (const std::string& name : tick_fault_names(faults)) text += (text.empty() ? "" : "|") + name;
  return text.empty() ? "none" : text;
}

}  // namespace tandem
