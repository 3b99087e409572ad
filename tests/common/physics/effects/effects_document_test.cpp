// Scene authors choose an effect from the table in README.md. The table must contain every effect and be consistent
// with the code.
#include <gtest/gtest.h>

#include "tests/common/physics/effects/effect_support.hpp"

namespace tandem::physics {
namespace {

TEST(EffectsDocument, TableOfTheReadmeHasEveryEffectInOrder) {
  const std::vector<test::TableRow> rows = rows_of_readme();
  const auto models = every_model();
  ASSERT_EQ(rows.size(), models.size());
  std::string listed;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(models[i].index(), i);
    EXPECT_EQ(rows[i].at("effect"), "`" + name_of(models[i]) + "`");
    listed += (i == 0 ? "" : ", ") + name_of(models[i]);
  }
  EXPECT_EQ(listed_effect_names(), listed);
}

TEST(EffectsDocument, LabelsFollowFromWhatTheEffectsDoToEnergy) {
  for (const test::TableRow& row : rows_of_readme()) {
    const std::string& energy = row.at("energy");
    EXPECT_TRUE(energy == "dissipative" || energy == "conservative" || energy == "active") << row.at("effect");
    EXPECT_EQ(row.at("label"), energy == "active" ? "active" : "passive") << row.at("effect");
  }
}

}  // namespace
}  // namespace tandem::physics
