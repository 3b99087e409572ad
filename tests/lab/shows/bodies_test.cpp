// What one user feels of things that move, or give way: lifted, pressed into, pulled by a field; and of a
// passivity controller that has to let a force come back.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/lab/shows/loss_burst.hpp"
#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {
namespace {

TEST(Mass, IsFeltWithin15PercentAt200Ms) {
  const Shown mass("mass", disturbed(200));
  EXPECT_NEAR(mass["felt_mass_ratio"], 1, 0.15);
  EXPECT_LE(mass["felt_mass_interval_fraction"], 0.05);
  EXPECT_EQ(mass.outcome(), "completed");
}

TEST(Docking, ErrsByATenthOfTheAttractionAt100Ms) {
  const Shown docking("docking", disturbed(100));
  double peak_n = 0;
  for (const UserTrace& user : docking.reference().users) {
    for (const TickSample& tick : user.ticks) peak_n = std::max(peak_n, tick.displayed_D.f.norm());
  }
  EXPECT_LE(docking["contact_error_rms_n"], 0.1 * peak_n);
}

TEST(LossBurst, LetsTheForceRecoverUnderThePassivityController) {
  expect_recovery_from_bursts(true);
}

class Moving : public testing::TestWithParam<At> {};

TEST_P(Moving, MakesNoStepNoEnergyAndNoWorkForThePassivityController) {
  const Shown shown(GetParam().experiment, GetParam().quantities());
  EXPECT_LE(shown["force_step_max_n_per_ms"], 0.3) << "beyond the truth's own, where a thing is put down";
  EXPECT_EQ(shown["slew_activations"], 0);
  EXPECT_LE(shown["energy_created_max_j"], 0.005);
  const double dissipated = shown["passivity_dissipated_fraction"];
  EXPECT_FALSE(dissipated > 0.05) << dissipated;
  EXPECT_EQ(shown["tool_energy_limited_fraction"], 0);
}

INSTANTIATE_TEST_SUITE_P(Default, Moving, testing::Values(At{"mass", 200}, At{"docking", 100}),
                         [](const auto& each) { return name_of_case(each); });

}  // namespace
}  // namespace tandem::lab
