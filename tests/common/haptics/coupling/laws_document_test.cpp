// Users choose a law from the table in common/haptics/coupling/README.md. The table must agree with the catalog.
#include <gtest/gtest.h>

#include "common/haptics/coupling/laws.hpp"
#include "tests/support/markdown_table.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::haptics {
namespace {

std::string text_of(ToolDynamics tool) {
  switch (tool) {
    case ToolDynamics::kWithMass:
      return "with mass";
    case ToolDynamics::kMassless:
      return "massless";
    case ToolDynamics::kAtHandle:
      return "at handle";
  }
  return "unknown";
}

test::TableRow documented(const CouplingLawInfo& law) {
  return {{"law", "`" + std::string(law.name) + "`"},
          {"tool", text_of(law.tool)},
          {"energy", law.is_passive ? "passive" : "active"},
          {"model", "`" + std::string(law.model) + "`"},
          {"source", std::string(law.source)},
          {"limits", std::string(law.limits)}};
}

TEST(CouplingDocument, ListsEveryLawAsTheCatalogDescribesIt) {
  std::vector<test::TableRow> expected;
  for (const CouplingLawInfo& law : coupling_laws()) {
    expected.push_back(documented(law));
    for (const auto& [column, text] : expected.back()) EXPECT_FALSE(text.empty()) << law.name << ", " << column;
  }
  EXPECT_EQ(test::table_under(test::source_path("common/haptics/coupling/README.md").string(), "## The laws"),
            expected);
}

}  // namespace
}  // namespace tandem::haptics
