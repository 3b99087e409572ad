#include "common/haptics/coupling/stability.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

LoopDevice damped_device() {
  LoopDevice device;
  device.mass_kg = 0.1;
  device.damping_n_s_per_m = 0.2;
  device.has_torque = true;
  device.inertia_kg_m2 = 1e-4;
  device.damping_n_m_s_per_rad = 2e-4;
  return device;
}

const StabilityFinding* finding_of(const std::vector<StabilityFinding>& findings, StabilityVerdict verdict) {
  for (const StabilityFinding& finding : findings) {
    if (finding.verdict == verdict) return &finding;
  }
  return nullptr;
}

/// Returns `parameters` with the value that the finding proposes (its remedy), multiplied by `factor`.
CouplingParameters remedied(CouplingParameters parameters, const StabilityFinding& finding, double factor) {
  const double value = finding.remedy * factor;
  if (finding.parameter == "coupling.stiffness_n_per_m") parameters.stiffness_n_per_m = value;
  if (finding.parameter == "coupling.damping_n_s_per_m") parameters.damping_n_s_per_m = value;
  if (finding.parameter == "coupling.stiffness_n_m_per_rad") parameters.stiffness_n_m_per_rad = value;
  if (finding.parameter == "coupling.damping_n_m_s_per_rad") parameters.damping_n_m_s_per_rad = value;
  return parameters;
}

TEST(CheckCoupling, AnAcceptedCouplingIsStableForAnyHandAndContact) {
  Random random(test::test_seed(8), 0);
  for (int i = 0; i < 80; ++i) {
    SCOPED_TRACE("model " + std::to_string(i));
    LoopModel model = random_model(random);
    CouplingParameters parameters;
    parameters.stiffness_n_per_m = model.stiffness;
    parameters.damping_n_s_per_m = model.damping;
    LoopDevice device;
    device.mass_kg = model.device_mass;
    device.period_s = model.period_s;
    device.velocity_window = model.velocity_window;
    device.delay_periods = model.delay_periods;
    // For a device with too little damping, the check proposes the smallest damping that passes. The test continues
    // with this damping.
    device.damping_n_s_per_m = 1e-6;
    for (const StabilityFinding& finding : check_coupling(parameters, model.tool_mass, 0, device)) {
      if (finding.parameter == "device.damping_n_s_per_m") device.damping_n_s_per_m = finding.remedy;
    }
    if (!check_coupling(parameters, model.tool_mass, 0, device).empty()) continue;
    model.device_damping = device.damping_n_s_per_m;
    EXPECT_LT(spectral_radius(model), 1);
  }
}

TEST(CheckCoupling, AcceptsACouplingThatTheMechanismDampsEnough) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 300;
  parameters.damping_n_s_per_m = 0.04;
  parameters.stiffness_n_m_per_rad = 0.2;
  parameters.damping_n_m_s_per_rad = 5e-5;
  EXPECT_TRUE(check_coupling(parameters, 0.1, 4e-5, damped_device()).empty());
}

TEST(CheckCoupling, NamesTheLargestStiffnessThatIsStable) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 50000;
  parameters.stiffness_n_m_per_rad = 100;
  const auto findings = check_coupling(parameters, 0.1, 4e-5, damped_device());
  ASSERT_EQ(findings.size(), 2U);
  for (const StabilityFinding& finding : findings) {
    EXPECT_EQ(finding.verdict, StabilityVerdict::kUnstable);
    EXPECT_GE(finding.spectral_radius, 1);
    EXPECT_THAT(finding.text, AllOf(HasSubstr(finding.parameter), HasSubstr("unstable"), HasSubstr("at most")));
    EXPECT_EQ(finding.text.find('\n'), std::string::npos);
  }
  EXPECT_EQ(findings[0].parameter, "coupling.stiffness_n_per_m");
  EXPECT_EQ(findings[1].parameter, "coupling.stiffness_n_m_per_rad");
  CouplingParameters good = remedied(remedied(parameters, findings[0], 1), findings[1], 1);
  EXPECT_EQ(finding_of(check_coupling(good, 0.1, 4e-5, damped_device()), StabilityVerdict::kUnstable), nullptr);
  for (const StabilityFinding& finding : findings) {
    const CouplingParameters more = remedied(good, finding, 1.02);
    const auto again = check_coupling(more, 0.1, 4e-5, damped_device());
    const StabilityFinding* refused = finding_of(again, StabilityVerdict::kUnstable);
    ASSERT_NE(refused, nullptr) << finding.text;
    EXPECT_EQ(refused->parameter, finding.parameter);
  }
}

TEST(CheckCoupling, NamesTheDampingWhereNoStiffnessWouldDo) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 200;
  parameters.damping_n_s_per_m = 400;  // far above the limit m/T = 100 N·s/m, with m = 0.1 kg and T = 1 ms
  LoopDevice device = damped_device();
  device.has_torque = false;
  const auto findings = check_coupling(parameters, 0.5, 0, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].parameter, "coupling.damping_n_s_per_m");
  EXPECT_LT(findings[0].remedy, 400);
  EXPECT_EQ(
      finding_of(check_coupling(remedied(parameters, findings[0], 1), 0.5, 0, device), StabilityVerdict::kUnstable),
      nullptr);
  EXPECT_NE(
      finding_of(check_coupling(remedied(parameters, findings[0], 1.02), 0.5, 0, device), StabilityVerdict::kUnstable),
      nullptr);
}

TEST(CheckCoupling, RequestsMoreDampingIfThereIsTooLittle) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 300;
  parameters.damping_n_s_per_m = 0;
  LoopDevice device;  // the device has no friction, and no hand damps the spring
  const auto findings = check_coupling(parameters, 0.1, 0, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].parameter, "coupling.damping_n_s_per_m");
  EXPECT_THAT(findings[0].text, AllOf(HasSubstr("is not held"), HasSubstr("at least")));
  EXPECT_EQ(
      finding_of(check_coupling(remedied(parameters, findings[0], 1), 0.1, 0, device), StabilityVerdict::kUnstable),
      nullptr);
  EXPECT_NE(
      finding_of(check_coupling(remedied(parameters, findings[0], 0.98), 0.1, 0, device), StabilityVerdict::kUnstable),
      nullptr);
}

TEST(CheckCoupling, EveryRemedyHolds) {
  Random random(test::test_seed(21), 0);
  const auto spread = [&](double low, double high) { return low * std::pow(high / low, random.uniform()); };
  int refused = 0, warned = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE("set-up " + std::to_string(i));
    CouplingParameters parameters;
    parameters.stiffness_n_per_m = spread(20, 100000);
    parameters.damping_n_s_per_m = spread(0.02, 500);
    LoopDevice device;
    device.mass_kg = spread(0.03, 0.5);
    device.damping_n_s_per_m = spread(0.01, 5);
    device.period_s = spread(2.5e-4, 4e-3);
    device.delay_periods = static_cast<int>(random.uniform() * 3);
    const double tool_mass = spread(0.01, 2);
    const auto findings = check_coupling(parameters, tool_mass, 0, device);
    if (findings.empty()) continue;
    const StabilityFinding& finding = findings.front();
    ASSERT_TRUE(std::isfinite(finding.remedy)) << finding.text;
    (finding.verdict == StabilityVerdict::kUnstable ? refused : warned) += 1;
    CouplingParameters changed = remedied(parameters, finding, 1);
    if (std::isfinite(finding.remedy_damping)) changed.damping_n_s_per_m = finding.remedy_damping;
    if (finding.parameter == "device.damping_n_s_per_m") device.damping_n_s_per_m = finding.remedy;
    const auto after = check_coupling(changed, tool_mass, 0, device);
    EXPECT_EQ(finding_of(after, finding.verdict), nullptr) << finding.text << "\nthen " << after.front().text;
  }
  EXPECT_GT(refused, 10);
  EXPECT_GT(warned, 10);
}

TEST(CheckCoupling, WarnsExactlyBelowColgatesBound) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 300;
  parameters.damping_n_s_per_m = 0.5;
  LoopDevice device;
  device.damping_n_s_per_m = 0.651;  // slightly above k T/2 + b = 0.15 + 0.5 N·s/m
  EXPECT_TRUE(check_coupling(parameters, 0.1, 0, device).empty());
  device.damping_n_s_per_m = 0.6;
  const auto findings = check_coupling(parameters, 0.1, 0, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].verdict, StabilityVerdict::kNotPassive);
  EXPECT_EQ(findings[0].parameter, "coupling.stiffness_n_per_m");
  EXPECT_NEAR(findings[0].remedy, 200, 1);  // rounded down to three digits
  EXPECT_LT(findings[0].spectral_radius, 1);
  device.damping_n_s_per_m = 0.4;  // less than the coupling's damping of 0.5 N·s/m
  EXPECT_EQ(check_coupling(parameters, 0.1, 0, device).at(0).parameter, "coupling.damping_n_s_per_m");
  EXPECT_NEAR(check_coupling(parameters, 0.1, 0, device).at(0).remedy, 0.25, 1e-3);
  device.damping_n_s_per_m = 0.1;  // less than k T/2 of the spring
  EXPECT_EQ(check_coupling(parameters, 0.1, 0, device).at(0).parameter, "device.damping_n_s_per_m");
  EXPECT_NEAR(check_coupling(parameters, 0.1, 0, device).at(0).remedy, 0.65, 1e-3);
}

TEST(CheckCoupling, RefusesValuesThatAreNotFinite) {
  CouplingParameters parameters;
  parameters.damping_n_s_per_m = std::nan("");
  const auto findings = check_coupling(parameters, 0.1, 0, damped_device());
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].verdict, StabilityVerdict::kUnstable);
  EXPECT_THAT(findings[0].text, HasSubstr("coupling.damping_n_s_per_m is nan"));
  LoopDevice timeless = damped_device();
  timeless.period_s = 0;
  ASSERT_FALSE(check_coupling({}, 0.1, 0, timeless).empty());
  EXPECT_THAT(check_coupling({}, 0.1, 0, timeless)[0].text, HasSubstr("period"));
}

TEST(CheckCoupling, ASteeperLawIsHeldToALowerStiffness) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 50000;
  LoopDevice device = damped_device();
  device.has_torque = false;
  const double linear = check_coupling(parameters, 0.1, 0, device, 1).at(0).remedy;
  const double steep = check_coupling(parameters, 0.1, 0, device, 2).at(0).remedy;
  EXPECT_NEAR(steep, linear / 2, 0.01 * linear);  // tolerance: the remedies have three digits
}

TEST(CheckCoupling, ADeviceWithoutAMassOfItsOwnIsNeverAlone) {
  LoopDevice device;
  device.mass_kg = 0;
  const auto loops = checked_loops({}, 0.1, 0, device);
  EXPECT_EQ(loops.size(), 2 * (checked_hands().size() - 1));
  EXPECT_TRUE(check_coupling({}, 0.1, 0, device).empty());
}

TEST(CheckCoupling, GivesItsRemedyInNewtonsPerMetreOfTheWorld) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 1e5;
  LoopDevice device = damped_device();
  device.has_torque = false;
  const double plain = check_coupling(parameters, 0.1, 0, device).at(0).remedy;
  // The hand receives a quarter of each force. With coefficients four times as large, the loop at the device is the
  // same as before.
  device.coupling_scale = 0.25;
  parameters.damping_n_s_per_m *= 4;
  const double scaled = check_coupling(parameters, 0.4, 0, device).at(0).remedy;
  EXPECT_NEAR(scaled, 4 * plain, 0.02 * scaled);  // the stiffness at the device is a quarter of that in the world
}

TEST(CheckedLoops, ScaleCouplingToolAndContactAlike) {
  LoopDevice device = damped_device();
  const auto plain = checked_loops({}, 0.4, 4e-5, device);
  device.coupling_scale = 0.25;
  device.rotational_coupling_scale = 4;
  const auto scaled = checked_loops({}, 0.4, 4e-5, device);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const double scale = plain[i].is_rotation ? 4 : 0.25;
    EXPECT_EQ(scaled[i].model.stiffness, scale * plain[i].model.stiffness);
    EXPECT_EQ(scaled[i].model.damping, scale * plain[i].model.damping);
    EXPECT_EQ(scaled[i].model.tool_mass, scale * plain[i].model.tool_mass);
    EXPECT_EQ(scaled[i].model.contact_stiffness, scale * plain[i].model.contact_stiffness);
    EXPECT_EQ(scaled[i].model.device_mass, plain[i].model.device_mass);
  }
}

TEST(CheckedLoops, CoverEveryHandInTheAirAndInContact) {
  const auto loops = checked_loops({}, 0.1, 4e-5, damped_device());
  EXPECT_EQ(loops.size(), 2 * 2 * checked_hands().size());
  for (const CheckedLoop& loop : loops) EXPECT_EQ(loop.spectral_radius, spectral_radius(loop.model));
  LoopDevice point = damped_device();
  point.has_torque = false;
  EXPECT_EQ(checked_loops({}, 0.1, 4e-5, point).size(), 2 * checked_hands().size());
}

}  // namespace
}  // namespace tandem::haptics
