// README.md is what authors read before they choose an effect: its table is held against the catalog.
#include <gtest/gtest.h>

#include <set>

#include "common/physics/effects/catalog.hpp"
#include "tests/support/markdown_table.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::physics {
namespace {

std::string energy_text(EffectEnergy energy) {
  switch (energy) {
    case EffectEnergy::kDissipative:
      return "dissipative";
    case EffectEnergy::kConservative:
      return "conservative";
    case EffectEnergy::kActive:
      break;
  }
  return "active";
}

TEST(EffectCatalog, TableOfTheReadmeIsTheCatalog) {
  const std::vector<test::TableRow> rows =
      test::table_under(test::source_path("common/physics/effects/README.md").string(), "## Catalog");
  ASSERT_EQ(rows.size(), effect_catalog().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const EffectInfo& info = effect_catalog()[i];
    test::TableRow row = rows[i];
    EXPECT_EQ(row["effect"], "`" + std::string(info.name) + "`");
    EXPECT_EQ(row["energy"], energy_text(info.energy)) << info.name;
    EXPECT_EQ(row["label"], passivity_label(info)) << info.name;
    EXPECT_EQ(row["model"], info.model) << info.name;
    EXPECT_EQ(row["source"], info.source) << info.name;
    EXPECT_EQ(row["limits"], info.limits) << info.name;
  }
}

TEST(EffectCatalog, NamesAreDistinctAndListed) {
  std::set<std::string_view> names;
  for (const EffectInfo& info : effect_catalog()) {
    names.insert(info.name);
    EXPECT_NE(listed_effect_names().find(info.name), std::string::npos);
  }
  EXPECT_EQ(names.size(), effect_catalog().size());
  EXPECT_EQ(effect_info(EffectModel(StickSlip{})).name, "stick_slip");
}

}  // namespace
}  // namespace tandem::physics
