// Tests that the claims of the comparisons of laws hold, and that the functions that they use are correct.
#include "lab/studies/rendering/reproduce_laws.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "lab/metrics/high_pass.hpp"
#include "lab/studies/rendering/hand_rig.hpp"
#include "lab/studies/rendering/law_curves.hpp"
#include "lab/studies/rendering/steady_press.hpp"
#include "tests/lab/studies/rendering/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproduceLaws, SagIsWeightOverStiffness) {
  expect_claims(reproduce_displacement(SteadyClock{}));
}

TEST(ReproduceLaws, ForceNeverPassesItsLimit) {
  expect_claims(reproduce_saturation(SteadyClock{}));
}

TEST(ReproduceLaws, OnlySwitchingLawsGiveMoreThanTheyGot) {
  expect_claims(reproduce_growth(SteadyClock{}));
}

TEST(LawCurves, TheSecantOfEveryCurveIsTheRequestedStiffness) {
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (law.tool == haptics::ToolDynamics::kAtHandle) continue;
    const haptics::CouplingParameters coupling = with_secant_stiffness(law.name, haptics::CouplingParameters{}, 250, 1);
    EXPECT_NEAR(displacement_m(law.name, coupling, 1), 1.0 / 250, 1e-12) << law.name;
  }
  EXPECT_THROW(displacement_m("rubber band", haptics::CouplingParameters{}, 1), std::invalid_argument);
  EXPECT_THROW(displacement_m("spring-damper", haptics::CouplingParameters{}, 100), std::invalid_argument);
}

TEST(LawCurves, StableDynamicIsSteepestWhereItsSecondDerivativeIsZero) {
  // The curve F (1 − e^(−u²)) is steepest at u = 1/√2, where its slope is √(2/e) k. F is the force limit, k the
  // stiffness, and u = k d / F for the displacement d.
  const haptics::CouplingParameters coupling;
  const double steepest_m = steepest_displacement_m("stable-dynamic", coupling);
  const double d_max = coupling.force_limit_n / coupling.stiffness_n_per_m;
  EXPECT_NEAR(steepest_m, d_max / std::numbers::sqrt2, 1e-3 * d_max);
  const auto law = haptics::make_coupling_law("stable-dynamic", coupling);
  const double by_m = 1e-4 * d_max;
  const double slope_n_per_m =
      (elastic_force_n(*law, steepest_m + by_m, true) - elastic_force_n(*law, steepest_m - by_m, true)) / (2 * by_m);
  EXPECT_NEAR(slope_n_per_m, std::sqrt(2 / std::numbers::e) * coupling.stiffness_n_per_m, 1e-3);
}

TEST(HighPass, KeepsVibrationAndDropsTremor) {
  std::vector<double> tremor, vibration;
  for (int i = 0; i < 4000; ++i) {
    tremor.push_back(std::sin(2 * std::numbers::pi * 9 * i / 1000.0));
    vibration.push_back(std::sin(2 * std::numbers::pi * 120 * i / 1000.0));
  }
  const auto settled = [](const std::vector<double>& samples) { return rms(std::span(samples).subspan(1000)); };
  // The filter must suppress the tremor at 9 Hz. It reduces the tremor's RMS of 0.707 by the factor (9/30)^8 = 6.6e-5,
  // and slightly more because the corner frequency of 30 Hz is prewarped.
  EXPECT_LT(settled(high_passed(tremor, 1000, 30)), 5e-5);
  EXPECT_NEAR(settled(high_passed(vibration, 1000, 30)), std::sqrt(0.5), 1e-3);
}

TEST(HandRig, PressesWithTheForceOfTheStretchedHandSpring) {
  PressSettings exact;
  exact.encoder_step_m = exact.tremor_rms_n = 0;
  exact.recorded_s = 1;
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    // The law "stable-dynamic-literal" has no equilibrium, because its force jumps at every reversal of the hand. Laws
    // that switch between two curves can rest on either curve.
    if (law.name == "stable-dynamic-literal") continue;
    const SteadyPress press = press_steadily(law.name, 1, exact);
    EXPECT_NEAR(press.mean_normal_n, 1, law.is_passive || law.name == "direct" ? 1e-6 : 0.1) << law.name;
  }
}

TEST(HandRig, RefusesAnUnknownLawByName) {
  HandRigSettings settings;
  settings.law = "rubber band";
  EXPECT_THROW(HandRig(settings, devices::named_hand_path("rest")), std::invalid_argument);
}

TEST(HandRig, RunsTheSameTwice) {
  PressSettings settings;
  settings.settling_s = 0.5;
  settings.recorded_s = 0.5;
  const SteadyPress a = press_steadily("stable-dynamic", 0.5, settings);
  EXPECT_EQ(a.normal_n, press_steadily("stable-dynamic", 0.5, settings).normal_n);
  settings.seed = 2;
  EXPECT_NE(a.normal_n, press_steadily("stable-dynamic", 0.5, settings).normal_n);
}

}  // namespace
}  // namespace tandem::lab
