// Tests the forces on one user in contact with bodies that move or yield: lifted bodies, soft bodies, and molecules in
// a field. In one case, the passivity controller must let the force return.

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

TEST(Docking, ErrsByLessThanAFifteenthOfTheAttraction) {
  for (const double round_trip_ms : {50.0, 100.0}) {
    const Shown docking("docking", disturbed(round_trip_ms));
    EXPECT_LE(docking["path_error_of_peak"], 1.0 / 15) << round_trip_ms;
    EXPECT_LE(docking["path_torque_error_of_peak"], 0.1) << round_trip_ms;
    EXPECT_LE(docking["limit_cycle_m_per_s"], 0.001) << round_trip_ms;
    EXPECT_LE(docking["energy_created_max_j"], 0.002) << round_trip_ms;
  }
}

TEST(Docking, HasAtMostHalfTheForceErrorOfNoPrediction) {
  for (const double round_trip_ms : {100.0, 200.0}) {
    const Shown docking("docking", disturbed(round_trip_ms));
    const Shown without_predictor("docking", disturbed(round_trip_ms, {"predictor=none"}));
    EXPECT_LE(docking["path_error_of_peak"], 0.5 * without_predictor["path_error_of_peak"]) << round_trip_ms;
    EXPECT_LE(docking["path_torque_error_of_peak"], 0.6 * without_predictor["path_torque_error_of_peak"])
        << round_trip_ms;
  }
}

// The local model has a wrong mass. Its error must be corrected by the residual force, which is the server's force
// minus the local model's. Fails if the residual force is displayed with too small a gain; the gain depends on how
// accurately the residual force was predicted before.
TEST(MassOfTheModel, WrongByFortyPercentIsFeltRight) {
  for (const char* scale : {"model.mass_scale=0.6", "model.mass_scale=1.4"}) {
    const Shown mass("mass", disturbed(100, {scale}));
    EXPECT_EQ(mass.outcome(), "completed") << scale;
    EXPECT_NEAR(mass["hold_force_ratio"], 1, 0.08) << scale;
    EXPECT_LE(mass["force_step_max_n_per_ms"], 0.3) << scale;
    const Shown without_predictor("mass", disturbed(100, {scale, "predictor=none"}));
    EXPECT_LE(mass["path_error_of_peak"], 0.5 * without_predictor["path_error_of_peak"]) << scale;
  }
}

TEST(MassOfTheModel, AnErrorOf20PercentDropsNoBodyWithoutDelay) {
  for (const char* scale : {"model.mass_scale=0.8", "model.mass_scale=0.85", "model.mass_scale=1.2"}) {
    const Shown mass("mass", {"link.rtt_ms=0", scale});
    EXPECT_EQ(mass.outcome(), "completed") << scale;
    EXPECT_GE(mass["hold_force_ratio"], 0.9) << scale;
  }
}

TEST(LossBurst, TheForceRecoversWithThePassivityController) {
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
