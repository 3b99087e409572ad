#include "common/haptics/coupling/stability.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// The same loop told step by step: nothing of the transition matrix.
class SimulatedLoop {
 public:
  SimulatedLoop(const LoopModel& model, double start)
      : m_(model), x_(start), seen_(static_cast<std::size_t>(model.velocity_window + model.delay_periods + 1), start) {}

  void period() {
    seen_.push_front(x_);
    seen_.pop_back();
    const auto d = static_cast<std::size_t>(m_.delay_periods), n = static_cast<std::size_t>(m_.velocity_window);
    const double T = m_.period_s;
    const double handle = seen_[d], handle_velocity = (seen_[d] - seen_[d + n]) / (static_cast<double>(n) * T);
    // The end-of-step velocity u with m (u − u₀)/T = force(y + T u, u) is where a line crosses zero.
    const auto force = [&](double u) {
      return m_.stiffness * (handle - y_ - T * u) + m_.damping * (handle_velocity - u);
    };
    const auto imbalance = [&](double u) {
      return m_.tool_mass * (u - u_) / T - force(u) + m_.contact_stiffness * (y_ + T * u);
    };
    const double at_0 = imbalance(0), slope = imbalance(1) - at_0;
    u_ = -at_0 / slope;
    y_ += T * u_;
    move_hand(-force_on_tool(handle, handle_velocity));
  }

  /// Of all that the loop feels: where nothing is tied down, not where things are.
  double size() const {
    return (is_tied() ? std::abs(x_) : 0) + std::abs(y_ - x_) + 0.01 * (std::abs(v_) + std::abs(u_));
  }
  /// Shrinks or grows all; what is not tied down is brought back to 0, so that differences keep their digits.
  void scale(double by) {
    const double origin = is_tied() ? 0 : x_;
    for (double* a : {&x_, &y_}) *a = (*a - origin) * by;
    for (double* a : {&v_, &u_}) *a *= by;
    for (double& a : seen_) a = (a - origin) * by;
  }

 private:
  bool is_tied() const { return m_.hand_stiffness > 0 || m_.contact_stiffness > 0; }
  double force_on_tool(double handle, double handle_velocity) const {
    return m_.stiffness * (handle - y_) + m_.damping * (handle_velocity - u_);
  }
  // Runge–Kutta of fourth order, 20 steps a period.
  void move_hand(double force) {
    const double mass = m_.hand_mass + m_.device_mass, b = m_.hand_damping + m_.device_damping;
    const double h = m_.period_s / 20;
    const auto a = [&](double x, double v) { return (force - m_.hand_stiffness * x - b * v) / mass; };
    for (int i = 0; i < 20; ++i) {
      const double v1 = v_, a1 = a(x_, v_);
      const double v2 = v_ + h / 2 * a1, a2 = a(x_ + h / 2 * v1, v2);
      const double v3 = v_ + h / 2 * a2, a3 = a(x_ + h / 2 * v2, v3);
      const double v4 = v_ + h * a3, a4 = a(x_ + h * v3, v4);
      x_ += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
      v_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  }

  LoopModel m_;
  double x_, v_ = 0.02, y_ = 0, u_ = -0.01;
  std::deque<double> seen_;
};

/// Growth per period of the simulated loop, after what dies sooner has died.
double simulated_growth(const LoopModel& model) {
  constexpr int kSettling = 4000, kBetween = 8000, kStretch = 1000;
  SimulatedLoop loop(model, 1e-3);
  double log_scale = 0;
  const auto run = [&](int periods) {
    double log_peak = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < periods; ++i) {
      loop.period();
      const double size = loop.size();
      log_peak = std::max(log_peak, std::log(size) + log_scale);
      loop.scale(1 / size);
      log_scale += std::log(size);
    }
    return log_peak;
  };
  run(kSettling);
  // Peaks of a stretch, so that the phase of an oscillation does not count.
  const double first = run(kStretch);
  run(kBetween - kStretch);
  return std::exp((run(kStretch) - first) / kBetween);
}

LoopModel random_model(Random& random) {
  const auto spread = [&](double low, double high) { return low * std::pow(high / low, random.uniform()); };
  LoopModel m;
  m.period_s = spread(2.5e-4, 4e-3);
  m.stiffness = spread(50, 5000);
  m.damping = random.uniform() < 0.2 ? 0 : spread(0.1, 20);
  m.tool_mass = random.uniform() < 0.2 ? 0 : spread(0.02, 2);
  m.device_mass = spread(0.05, 0.5);
  m.device_damping = spread(0.05, 5);
  const bool is_held = random.uniform() < 0.7;
  m.hand_mass = is_held ? spread(0.1, 1) : 0;
  m.hand_stiffness = is_held ? spread(50, 1000) : 0;
  m.hand_damping = is_held ? spread(1, 20) : 0;
  m.contact_stiffness = random.uniform() < 0.5 ? 0 : spread(1000, 50000);
  m.velocity_window = 1 + static_cast<int>(random.uniform() * 10);
  m.delay_periods = static_cast<int>(random.uniform() * 4);
  return m;
}

/// A device at a coupling to something that does not move.
LoopModel held_spring(double stiffness, double damping, double mass, double device_damping) {
  LoopModel m;
  m.stiffness = stiffness;
  m.damping = damping;
  m.tool_mass = 0.1;
  m.contact_stiffness = 1e12;  // the tool gives way by 1e-9 of the hand's travel
  m.device_mass = mass;
  m.device_damping = device_damping;
  m.hand_mass = m.hand_stiffness = m.hand_damping = 0;
  return m;
}

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

/// `parameters` with the finding's remedy times `factor` put in.
CouplingParameters remedied(CouplingParameters parameters, const StabilityFinding& finding, double factor) {
  const double value = finding.remedy * factor;
  if (finding.parameter == "coupling.stiffness_n_per_m") parameters.stiffness_n_per_m = value;
  if (finding.parameter == "coupling.damping_n_s_per_m") parameters.damping_n_s_per_m = value;
  if (finding.parameter == "coupling.stiffness_n_m_per_rad") parameters.stiffness_n_m_per_rad = value;
  if (finding.parameter == "coupling.damping_n_m_s_per_rad") parameters.damping_n_m_s_per_rad = value;
  return parameters;
}

TEST(SpectralRadius, IsTheGrowthOfTheSimulatedLoop) {
  Random random(test::test_seed(4), 0);
  int unstable = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE("model " + std::to_string(i));
    const LoopModel model = random_model(random);
    const double radius = spectral_radius(model);
    unstable += radius >= 1 ? 1 : 0;
    // Two modes of about the same radius beat, a factor of 2, and a nearly double one also grows as the time, a factor
    // of 13000/5000: over 8000 periods 2.1e-4.
    EXPECT_NEAR(simulated_growth(model), radius, 2.1e-4 * radius);
  }
  EXPECT_GT(unstable, 0);
  EXPECT_LT(unstable, 50);
}

TEST(SpectralRadius, CrossesOneWhereJurysCriterionSaysForASpringOnAMassWithDamping) {
  const double T = 1e-3, m = 0.1, b = 0.5;
  // Held force, exact: x⁺ = x + c v − k g x, v⁺ = a v − k h x. The product of the eigenvalues reaches 1 first.
  const double a = std::exp(-b * T / m), c = (1 - a) * m / b, h = (1 - a) / b, g = (T - c) / b;
  const double largest = (1 - a) / (h * c - a * g);
  EXPECT_LT(spectral_radius(held_spring(largest * 0.9999, 0, m, b)), 1);
  EXPECT_GT(spectral_radius(held_spring(largest * 1.0001, 0, m, b)), 1);
  // and it is near Colgate's 2 b / T, which holds for every hand.
  EXPECT_NEAR(largest, 2 * b / T, 0.01 * 2 * b / T);
}

TEST(SpectralRadius, OfAnUndampedSampledSpringIsAboveOneAtAnyStiffness) {
  for (const double stiffness : {1.0, 10.0, 100.0, 1000.0, 10000.0}) {
    // The determinant of the held oscillator is 1 + (1 − cos φ)…: to first order 1 + k T²/(2 m), the radius its root.
    const double growth = std::sqrt(1 + stiffness * 1e-6 / (2 * 0.1));
    EXPECT_NEAR(spectral_radius(held_spring(stiffness, 0, 0.1, 0)), growth, 1e-8 + 0.2 * (growth - 1)) << stiffness;
    EXPECT_GT(spectral_radius(held_spring(stiffness, 0, 0.1, 0)), 1) << stiffness;
  }
}

TEST(SpectralRadius, IsBelowOneInsideColgatesBoundAtAToolHeldFastInEveryHand) {
  Random random(test::test_seed(7), 0);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE("model " + std::to_string(i));
    LoopModel model = random_model(random);
    model.contact_stiffness = 1e12;
    model.device_damping = model.stiffness * model.period_s * (0.5 + model.delay_periods) + model.damping;
    EXPECT_LT(spectral_radius(model), 1);
  }
}

TEST(CheckCoupling, NothingFoundMeansStableInAnyHandAndContact) {
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
    // The least damping that passes, by what the warning asks for.
    device.damping_n_s_per_m = 1e-6;
    for (const StabilityFinding& finding : check_coupling(parameters, model.tool_mass, 0, device)) {
      if (finding.parameter == "device.damping_n_s_per_m") device.damping_n_s_per_m = finding.remedy;
    }
    if (!check_coupling(parameters, model.tool_mass, 0, device).empty()) continue;
    model.device_damping = device.damping_n_s_per_m;
    EXPECT_LT(spectral_radius(model), 1);
  }
}

TEST(SpectralRadius, DependsOnRateByScaleOnly) {
  // Time in units of the period: k T²/m and b T/m are all that counts.
  Random random(test::test_seed(9), 0);
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE("model " + std::to_string(i));
    const LoopModel model = random_model(random);
    LoopModel faster = model;
    faster.period_s /= 4;
    for (double* stiffness : {&faster.stiffness, &faster.hand_stiffness, &faster.contact_stiffness}) *stiffness *= 16;
    for (double* damping : {&faster.damping, &faster.device_damping, &faster.hand_damping}) *damping *= 4;
    EXPECT_NEAR(spectral_radius(faster), spectral_radius(model), 1e-6);
  }
}

TEST(SpectralRadius, LeavesOutDriftAndGlideOfWhatNothingHolds) {
  LoopModel model;
  model.hand_mass = model.hand_stiffness = model.hand_damping = 0;
  model.stiffness = 300;
  model.damping = 1;
  EXPECT_LT(spectral_radius(model), 0.9999);
  model.device_damping = 0.2;
  EXPECT_LT(spectral_radius(model), 1);  // common motion dies out, slowly
  EXPECT_GT(spectral_radius(model), 0.9985);
  model.device_damping = 0;
  EXPECT_LT(spectral_radius(model), 0.9999);
  model.delay_periods = 20;
  EXPECT_GT(spectral_radius(model), 1);  // what does harm is not left out
  model.delay_periods = 0;
  model.stiffness = 0;
  EXPECT_LT(spectral_radius(model), 1);
}

TEST(SpectralRadius, OfNoCouplingIsZero) {
  LoopModel model;
  model.stiffness = model.damping = 0;
  EXPECT_EQ(spectral_radius(model), 0);
}

TEST(SpectralRadius, IsInfiniteForAModelThatCannotBe) {
  const auto changed = [](auto change) {
    LoopModel model;
    change(model);
    return spectral_radius(model);
  };
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(changed([](LoopModel& m) { m.stiffness = std::nan(""); }), infinity);
  EXPECT_EQ(changed([](LoopModel& m) { m.damping = -1; }), infinity);
  EXPECT_EQ(changed([&](LoopModel& m) { m.tool_mass = infinity; }), infinity);
  EXPECT_EQ(changed([](LoopModel& m) { m.device_mass = m.hand_mass = 0; }), infinity);
  EXPECT_EQ(changed([](LoopModel& m) { m.period_s = 0; }), infinity);
  EXPECT_EQ(changed([](LoopModel& m) { m.velocity_window = 0; }), infinity);
  EXPECT_EQ(changed([](LoopModel& m) { m.delay_periods = 1 << 30; }), infinity);
}

TEST(CheckCoupling, FindsNothingInACouplingThatTheMechanismPaysFor) {
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
  parameters.damping_n_s_per_m = 400;  // against 0.1 kg and 1 ms: far past m/T
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

TEST(CheckCoupling, AsksForDampingWhereThereIsTooLittle) {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 300;
  parameters.damping_n_s_per_m = 0;
  LoopDevice device;  // frictionless: nobody's hand damps the spring
  const auto findings = check_coupling(parameters, 0.1, 0, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].parameter, "coupling.damping_n_s_per_m");
  EXPECT_THAT(findings[0].text, AllOf(HasSubstr("nobody"), HasSubstr("at least")));
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
  device.damping_n_s_per_m = 0.651;  // k T/2 + b = 0.65
  EXPECT_TRUE(check_coupling(parameters, 0.1, 0, device).empty());
  device.damping_n_s_per_m = 0.6;
  const auto findings = check_coupling(parameters, 0.1, 0, device);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].verdict, StabilityVerdict::kNotPassive);
  EXPECT_EQ(findings[0].parameter, "coupling.stiffness_n_per_m");
  EXPECT_NEAR(findings[0].remedy, 200, 1);  // three digits, rounded down
  EXPECT_LT(findings[0].spectral_radius, 1);
  device.damping_n_s_per_m = 0.4;  // less than the coupling's damping alone
  EXPECT_EQ(check_coupling(parameters, 0.1, 0, device).at(0).parameter, "coupling.damping_n_s_per_m");
  EXPECT_NEAR(check_coupling(parameters, 0.1, 0, device).at(0).remedy, 0.25, 1e-3);
  device.damping_n_s_per_m = 0.1;  // less than the spring alone
  EXPECT_EQ(check_coupling(parameters, 0.1, 0, device).at(0).parameter, "device.damping_n_s_per_m");
  EXPECT_NEAR(check_coupling(parameters, 0.1, 0, device).at(0).remedy, 0.65, 1e-3);
}

TEST(CheckCoupling, RefusesNumbersThatAreNone) {
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
  EXPECT_NEAR(steep, linear / 2, 0.01 * linear);  // three digits each
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
  // Handle and hand feel a quarter of everything: the same loop at four times the numbers.
  device.coupling_scale = 0.25;
  parameters.damping_n_s_per_m *= 4;
  const double scaled = check_coupling(parameters, 0.4, 0, device).at(0).remedy;
  EXPECT_NEAR(scaled, 4 * plain, 0.02 * scaled);  // held fast is a quarter as stiff there
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

TEST(SteepestSlope, IsTheLargestGradientOfEveryLaw) {
  for (const double sharpness : {0.1, 0.5, 1.0, 3.0, 10.0}) {
    CouplingParameters parameters;
    parameters.curve_sharpness = sharpness;
    for (const CouplingLawInfo& info : coupling_laws()) {
      if (info.name == "direct") continue;
      const auto law = info.make(parameters);
      double steepest = 0;
      for (int i = 0; i < 4000; ++i) {
        CouplingState state;
        state.d_W.x() = i * 5e-5;  // to 0.2 m
        for (const double speed : {-1e-12, 1e-12}) {
          state.v_WH.x() = speed;
          const double slope = law->gradient(state).force_by_d(0, 0);
          steepest = std::max(steepest, slope);
        }
      }
      // The grid meets the steepest point to a part of 1e-4 or better.
      EXPECT_NEAR(steepest, steepest_slope_factor(info.name, parameters) * parameters.stiffness_n_per_m,
                  1e-3 * parameters.stiffness_n_per_m)
          << info.name << ", c = " << sharpness;
    }
  }
}

}  // namespace
}  // namespace tandem::haptics
