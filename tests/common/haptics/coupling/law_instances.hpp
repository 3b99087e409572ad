// The laws of the catalog as parameters of GoogleTest tests.
#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <ostream>
#include <string>
#include <vector>

#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {

/// Prints the law of a failed test; called by GoogleTest.
inline void PrintTo(const CouplingLawInfo& law, std::ostream* out) {
  *out << law.name;
}

/// Returns the name of the test instance, such as "StableDynamicLiteral".
inline std::string law_test_name(const testing::TestParamInfo<CouplingLawInfo>& info) {
  std::string name;
  bool is_first = true;
  for (const char letter : info.param.name) {
    if (letter != '-') name += is_first ? static_cast<char>(std::toupper(letter)) : letter;
    is_first = letter == '-';
  }
  return name;
}

/// Returns the passive laws of the catalog, or the active laws that exert a force on the tool.
inline std::vector<CouplingLawInfo> laws_that_are(bool is_passive) {
  std::vector<CouplingLawInfo> chosen;
  for (const CouplingLawInfo& law : coupling_laws()) {
    if (law.is_passive == is_passive && law.tool != ToolDynamics::kAtHandle) chosen.push_back(law);
  }
  return chosen;
}

}  // namespace tandem::haptics
