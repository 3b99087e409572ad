// The calibration recovers what is known beforehand, keeps its own rules, and its file is a profile like any other.
#include "lab/rendering/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "lab/rendering/calibration_report.hpp"
#include "lab/rendering/polynomial_fit.hpp"

namespace tandem::lab {
namespace {

bool any(const Cubic& /*cubic*/) {
  return true;
}

TEST(PolynomialFit, RecoversACubicThroughItsOwnPoints) {
  const Cubic cubic{{16.2, 116.5, -30, 4}};
  const std::vector<double> x{0.02, 0.1, 0.5, 1, 1.5, 2};
  std::vector<double> y;
  for (const double one : x) y.push_back(cubic(one));
  const ChosenFit fit = chosen_fit(x, y, any);
  EXPECT_EQ(fit.degree, 3);
  for (const double one : {0.05, 0.3, 1.9}) EXPECT_NEAR(fit.cubic(one), cubic(one), 1e-9 * cubic(one));
}

TEST(PolynomialFit, ALineWithScatterIsALine) {
  // The thesis's line, ±2 % in turn: a parabola or cubic would fit the points better and the left-out ones worse.
  const std::vector<double> x{0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2};
  std::vector<double> y;
  for (std::size_t i = 0; i < x.size(); ++i) y.push_back((116.53 * x[i] + 16.21) * (i % 2 == 0 ? 1.02 : 0.98));
  const ChosenFit fit = chosen_fit(x, y, any);
  EXPECT_EQ(fit.degree, 1);
  EXPECT_NEAR(fit.cubic(0.1), 116.53 * 0.1 + 16.21, 0.02 * 28);
}

TEST(PolynomialFit, EqualValuesAndSinglePointsAreConstants) {
  EXPECT_EQ(chosen_fit(std::vector{1.0, 2.0, 3.0}, std::vector{7.0, 7.0, 7.0}, any).degree, 0);
  EXPECT_DOUBLE_EQ(chosen_fit(std::vector{1.0}, std::vector{7.0}, any).cubic(5), 7);
}

TEST(PolynomialFit, WhatIsNotAllowedIsNotChosen) {
  const std::vector<double> x{1, 2, 3, 4, 5};
  const std::vector<double> y{1, 4, 9, 16, 25};
  EXPECT_EQ(chosen_fit(x, y, any).degree, 2);
  EXPECT_LT(chosen_fit(x, y, [](const Cubic& cubic) { return cubic.c[2] == 0; }).degree, 2);
}

TEST(CouplingTrial, SettlesSoonestAtTheClosedFormsDamping) {
  // A mass on spring and damper, of which nothing but the other end jumps: ∫ t |d| dt is least at b = 1.4 √(k m)
  // (Graham, Lathrop 1953). Sampling shifts it by about k T.
  const CouplingTrial trial(find_device_profile("sim"), false, {});
  for (const double mass_kg : {0.05, 0.2}) {
    const double closed_form = 1.4 * std::sqrt(400 * mass_kg);
    double best = 0;
    double least = INFINITY;
    for (double b = 0.3 * closed_form; b < 3 * closed_form; b *= 1.05) {
      const double cost = trial.settling_cost({400, b}, mass_kg);
      if (cost < least) {
        least = cost;
        best = b;
      }
    }
    EXPECT_NEAR(best, closed_form, 0.05 * closed_form + 400 * 1e-3) << mass_kg << " kg";
  }
}

TEST(CouplingTrial, TheSpectralRadiusTellsTheStiffnessLimitOfAHeldHandle) {
  // In a delay of one period a stiffness that is far beyond what any hand pays for is unstable, a soft one is not.
  const CouplingTrial trial(find_device_profile("touch"), false, {});
  EXPECT_LT(trial.spectral_radius({100, 2}, 0.1), 1);
  EXPECT_GT(trial.spectral_radius({1e5, 2}, 0.1), 1);
  // Margins make it stricter: what is stable without them need not be with them.
  TrialSettings bare;
  bare.gain_margin = 1;
  bare.delay_margin_periods = 0;
  const CouplingTrial without(find_device_profile("touch"), false, bare);
  EXPECT_LT(without.spectral_radius({1000, 2}, 0.1), trial.spectral_radius({1000, 2}, 0.1));
}

TEST(CouplingTrial, RoughnessGrowsWithStiffnessAndWithTheEncoderStep) {
  const CouplingTrial falcon(find_device_profile("falcon"), false, {});
  const double soft = falcon.press({200, 4}, 0.1).roughness;
  const double stiff = falcon.press({2000, 4}, 0.1).roughness;
  EXPECT_GT(stiff, 3 * soft);
  const CouplingTrial omega(find_device_profile("omega.3"), false, {});
  EXPECT_LT(omega.press({2000, 4}, 0.1).roughness, stiff) << "a step six times finer";
}

CalibrationSettings four_masses() {
  CalibrationSettings settings;
  settings.masses_kg = {0.02, 0.05, 0.12, 0.3};
  return settings;
}

const Calibration& of_falcon() {
  static const Calibration calibration =
      calibrate(find_device_profile("falcon"), four_masses(), [](double /*done*/) {});
  return calibration;
}

TEST(Calibration, GivesHeavierToolsMoreStiffnessWithinTheDevicesMaximum) {
  const Calibration& calibration = of_falcon();
  const AdaptiveFit& fit = *calibration.profile.adaptive;
  const CouplingParameters most = coupling_bounds(calibration.profile);
  double before = 0;
  for (double mass_kg = 0.02; mass_kg <= 0.3; mass_kg *= 1.1) {
    const CouplingParameters c = adapted(fit, mass_kg, 0, most);
    EXPECT_GT(c.stiffness_n_per_m, before) << mass_kg << " kg";
    EXPECT_LE(c.stiffness_n_per_m, most.stiffness_n_per_m);
    EXPECT_GT(c.damping_n_s_per_m, 0);
    EXPECT_LE(c.damping_n_s_per_m, most.damping_n_s_per_m);
    before = c.stiffness_n_per_m;
  }
}

TEST(Calibration, StopsWhereMoreStiffnessWouldBreakARule) {
  const Calibration& calibration = of_falcon();
  TrialSettings settings = calibration.settings.trial;
  const CouplingTrial trial(calibration.profile, false, settings);
  for (const CalibrationPoint& point : calibration.translation.points) {
    EXPECT_LT(point.spectral_radius, 1);
    EXPECT_LE(point.press.restlessness, calibration.settings.restlessness_steps);
    EXPECT_LE(point.press.roughness, point.roughness_allowed);
    if (point.limited_by != "quiet") continue;
    // The bisection ends 3 % below the first stiffness that was too rough, with the damping of the stiffness step.
    const CouplingTrial::Press stiffer = trial.press({2 * point.best.stiffness, point.best.damping}, point.inertia);
    EXPECT_GT(stiffer.roughness, point.roughness_allowed) << point.mass_kg << " kg";
  }
}

TEST(Calibration, ItsFitKeepsTheMarginsAndNeverAddsStiffness) {
  const Calibration& calibration = of_falcon();
  EXPECT_TRUE(report::all_hold(checks_of(calibration))) << to_text(calibration);
  for (const CalibrationPoint& point : calibration.translation.points) {
    EXPECT_LE(point.fitted.stiffness, point.best.stiffness * (1 + 1e-12));
  }
}

TEST(Calibration, TheSameSettingsGiveTheSameBits) {
  const Calibration again = calibrate(find_device_profile("falcon"), four_masses(), [](double /*done*/) {});
  EXPECT_EQ(device_profiles_text({again.profile}), device_profiles_text({of_falcon().profile}));
}

TEST(Calibration, ItsFileIsAProfileThatLoadsIdentically) {
  const std::string text = device_profiles_text({of_falcon().profile});
  const std::string file = testing::TempDir() + "calibrated_falcon.json";
  std::ofstream(file) << text;
  const DeviceProfile loaded = find_device_profile(file);
  EXPECT_EQ(device_profiles_text({loaded}), text);
  ASSERT_TRUE(loaded.adaptive);
  EXPECT_EQ(loaded.adaptive->stiffness_n_per_m.c, of_falcon().profile.adaptive->stiffness_n_per_m.c);
  EXPECT_EQ(loaded.adaptive->mass_high_kg, of_falcon().profile.adaptive->mass_high_kg);
  EXPECT_EQ(loaded.adaptive_source, "tandem-lab calibrate --device falcon");
}

TEST(Calibration, RotationIsCalibratedWhereThereIsTorque) {
  EXPECT_FALSE(of_falcon().rotation);
  CalibrationSettings settings;
  settings.masses_kg = {0.02, 0.1};
  double progress = 0;
  const Calibration calibration =
      calibrate(find_device_profile("phantom-premium-1.5-6dof"), settings, [&](double done) {
        EXPECT_GE(done, progress);
        progress = done;
      });
  EXPECT_EQ(progress, 1);
  ASSERT_TRUE(calibration.rotation);
  const CouplingParameters most = coupling_bounds(calibration.profile);
  const CouplingParameters c = adapted(*calibration.profile.adaptive, 0.1, 4e-5, most);
  EXPECT_GT(c.stiffness_n_m_per_rad, 0);
  EXPECT_LE(c.stiffness_n_m_per_rad, most.stiffness_n_m_per_rad);
  EXPECT_LE(c.damping_n_m_s_per_rad, most.damping_n_m_s_per_rad);
}

TEST(Calibration, MassesThatFallOrAreNotMassesAreRefused) {
  for (const std::vector<double>& masses : {std::vector{0.2, 0.1}, std::vector{0.0, 0.1}, std::vector{0.1, 1e4}}) {
    CalibrationSettings settings;
    settings.masses_kg = masses;
    EXPECT_THROW(calibrate(find_device_profile("touch"), settings, [](double /*done*/) {}), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tandem::lab
