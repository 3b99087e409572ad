#include "common/haptics/coupling/sampled_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>

#include "common/haptics/coupling/stability.hpp"
#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

/// Reference for spectral_radius(): simulates the loop step by step, without a transition matrix.
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
    // The tool's velocity u at the end of the step satisfies m (u − u₀)/T = force(y + T u, u). Both sides are linear in
    // u, so two evaluations determine u.
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

  /// Returns the norm of the loop's state. If nothing is fixed to the ground, only relative positions count.
  double size() const {
    return (is_tied() ? std::abs(x_) : 0) + std::abs(y_ - x_) + 0.01 * (std::abs(v_) + std::abs(u_));
  }
  /// Scales the state. If nothing is fixed to the ground, the positions are also shifted to 0, so that their
  /// differences keep their precision.
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
  // Integrates with the fourth-order Runge–Kutta method in 20 steps per period.
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

/// Returns the factor by which the state of the simulated loop grows per period. The measurement begins after modes
/// that decay faster have vanished.
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
  // Compares the peaks of two intervals that begin kBetween periods apart. A peak does not depend on the phase of an
  // oscillation.
  const double first = run(kStretch);
  run(kBetween - kStretch);
  return std::exp((run(kStretch) - first) / kBetween);
}

/// Returns the loop of a device that is coupled to a fixed tool.
LoopModel held_spring(double stiffness, double damping, double mass, double device_damping) {
  LoopModel m;
  m.stiffness = stiffness;
  m.damping = damping;
  m.tool_mass = 0.1;
  m.contact_stiffness = 1e12;  // the tool yields by 1e-9 of the hand's displacement
  m.device_mass = mass;
  m.device_damping = device_damping;
  m.hand_mass = m.hand_stiffness = m.hand_damping = 0;
  return m;
}

TEST(SpectralRadius, IsTheGrowthOfTheSimulatedLoop) {
  Random random(test::test_seed(4), 0);
  int unstable = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE("model " + std::to_string(i));
    const LoopModel model = random_model(random);
    const double radius = spectral_radius(model);
    unstable += radius >= 1 ? 1 : 0;
    // Two effects limit the accuracy of the simulated growth:
    // - Two modes of almost equal radius beat, which changes the size by a factor of up to 2.
    // - A nearly double mode also grows linearly with time, here by a factor of up to 13000/5000.
    // Over 8000 periods, the error of the growth is ln(2 · 13000/5000) / 8000 = 2.1e-4.
    EXPECT_NEAR(simulated_growth(model), radius, 2.1e-4 * radius);
  }
  EXPECT_GT(unstable, 0);
  EXPECT_LT(unstable, 50);
}

TEST(SpectralRadius, CrossesOneAtJurysLimitForADampedMassOnASpring) {
  const double T = 1e-3, m = 0.1, b = 0.5;
  // Jury's limit of the stiffness k. The exact solution for a force that is held over the period T is x⁺ = x + c v − k
  // g x, v⁺ = a v − k h x, with the coefficients a, c, g, h below. At the limit, the product of the eigenvalues is 1: a
  // (1 − k g) + k h c = 1.
  const double a = std::exp(-b * T / m), c = (1 - a) * m / b, h = (1 - a) / b, g = (T - c) / b;
  const double largest = (1 - a) / (h * c - a * g);
  EXPECT_LT(spectral_radius(held_spring(largest * 0.9999, 0, m, b)), 1);
  EXPECT_GT(spectral_radius(held_spring(largest * 1.0001, 0, m, b)), 1);
  // The limit is close to Colgate's bound 2 b / T, which is valid for any hand.
  EXPECT_NEAR(largest, 2 * b / T, 0.01 * 2 * b / T);
}

TEST(SpectralRadius, OfAnUndampedSampledSpringIsAboveOneAtAnyStiffness) {
  for (const double stiffness : {1.0, 10.0, 100.0, 1000.0, 10000.0}) {
    // Expected growth for the stiffness k, the period T = 1 ms and the mass m = 0.1 kg. To first order, the determinant
    // of the oscillator with a held force is 1 + k T²/(2 m). The spectral radius is its square root.
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

TEST(SpectralRadius, DependsOnRateByScaleOnly) {
  // In units of the period T, only the numbers k T²/m and b T/m determine the loop (stiffness k, damping b, mass m). A
  // shorter period with the same numbers must give the same spectral radius.
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

TEST(SpectralRadius, ExcludesModesOfFreeMotion) {
  LoopModel model;
  model.hand_mass = model.hand_stiffness = model.hand_damping = 0;
  model.stiffness = 300;
  model.damping = 1;
  EXPECT_LT(spectral_radius(model), 0.9999);
  model.device_damping = 0.2;
  EXPECT_LT(spectral_radius(model), 1);  // the common motion of hand and tool decays slowly
  EXPECT_GT(spectral_radius(model), 0.9985);
  model.device_damping = 0;
  EXPECT_LT(spectral_radius(model), 0.9999);
  model.delay_periods = 20;
  EXPECT_GT(spectral_radius(model), 1);  // unstable modes must not be excluded
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

}  // namespace
}  // namespace tandem::haptics
