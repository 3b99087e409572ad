// Tests the energy balance of effects. Passive effects must not generate energy for any tool. For all other effects,
// the generated energy is compared with its expected value.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/common/physics/effects/effect_support.hpp"

namespace tandem::physics {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr std::array<double, 5> kMasses_kg = {0.005, 0.02, 0.05, 0.3, 2};

/// Returns the effects whose row in the README's table has `value` in `column`.
std::vector<EffectModel> models_where(const std::string& column, const std::string& value) {
  const std::vector<test::TableRow> rows = rows_of_readme();
  std::vector<EffectModel> models;
  for (const EffectModel& model : every_model()) {
    if (rows.at(model.index()).at(column) == value) models.push_back(model);
  }
  if (models.empty()) throw std::runtime_error("no effect is " + value);
  return models;
}

/// A closed path that is at rest at both ends. Its motion is as fast as that of a hand, including a tremor of 15 Hz.
class ClosedPath {
 public:
  explicit ClosedPath(std::uint64_t seed) {
    Random random(seed);
    for (int i = 1; i <= 30; ++i) {
      const double size_m = 0.03 / i;
      waves_.push_back({0.5 * i, random_vec3(random, size_m), random_vec3(random, size_m)});
    }
  }
  Vec3 at(double t_s) const {
    const double t = std::clamp(t_s / kDuration_s, 0.0, 1.0);
    Vec3 p = Vec3::Zero();
    for (const Wave& wave : waves_) {
      p += wave.sine * std::sin(kTurn * wave.hz * t_s) + wave.cosine * std::cos(kTurn * wave.hz * t_s);
    }
    return start + std::pow(std::sin(std::numbers::pi * t), 2) * p;
  }
  static constexpr double kDuration_s = 2;
  Vec3 start = {0.004, -0.003, 0.002};

 private:
  struct Wave {
    double hz;
    Vec3 sine, cosine;
  };
  std::vector<Wave> waves_;
};

/// Work of the effect along a path, Σ F_k · (x_{k+1} − x_k): at the end (net), and its largest value on the path.
struct Work {
  double net_j = 0;
  double highest_j = 0;
  Vec3 end = Vec3::Zero();  ///< last position of the tool; attraction may hold it slightly off the path
};

Work work_along(const Effect& effect, SteppedTool tool, const ClosedPath& path) {
  Work work;
  tool.p = path.start;
  const int steps = static_cast<int>((ClosedPath::kDuration_s + 0.5) / tool.step_s);
  for (int i = 0; i < steps; ++i) {
    const Vec3 from = tool.p;
    const Vec3 f = tool.step_to(effect, path.at(tool.time_s), 300, 5);
    work.net_j += f.dot(tool.p - from);
    work.highest_j = std::max(work.highest_j, work.net_j);
  }
  work.end = tool.p;
  return work;
}

TEST(EffectEnergy, DissipativeEffectsTakeEnergyOnEveryClosedPathAtEveryMass) {
  for (const EffectModel& model : models_where("energy", "dissipative")) {
    const Effect effect(ball_with(model));
    for (const double mass_kg : kMasses_kg) {
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        SteppedTool tool;
        tool.mass_kg = mass_kg;
        const Work work = work_along(effect, tool, ClosedPath(seed));
        EXPECT_LT(work.net_j, -1e-4) << name_of(model) << " mass " << mass_kg << " seed " << seed;
        EXPECT_LT(work.highest_j, 1e-5) << name_of(model) << " mass " << mass_kg << " seed " << seed;
      }
    }
  }
}

TEST(EffectEnergy, AMagnetGivesNoMoreThanItsPotentialOnEveryPath) {
  const Magnet magnet{2, 0.03, {0.01, 0, 0}};
  const Effect effect(effect_with(magnet));
  for (const double mass_kg : kMasses_kg) {
    for (std::uint64_t seed = 5; seed <= 8; ++seed) {
      SteppedTool tool;
      tool.mass_kg = mass_kg;
      const ClosedPath path(seed);
      const Work work = work_along(effect, tool, path);
      const double from_potential_j = magnet_potential_j(magnet, path.start) - magnet_potential_j(magnet, work.end);
      // The tolerance is less than 0.1 % of the depth of the magnet's potential, 35 mJ.
      EXPECT_LT(work.net_j - from_potential_j, 2e-5) << "mass " << mass_kg << " seed " << seed;
    }
  }
}

TEST(EffectEnergy, AMagnetsWorkOnAClosedPathVanishesWithTheSquareOfTheStep) {
  const Effect effect(effect_with(Magnet{2, 0.03, {0.01, 0, 0}}));
  const auto net_j = [&effect](double step_s) {
    const ClosedPath path(7);
    EffectMemory memory;
    double work = 0;
    const int steps = static_cast<int>(ClosedPath::kDuration_s / step_s);
    for (int i = 0; i < steps; ++i) {
      const Vec3 from = path.at(i * step_s), way = path.at((i + 1) * step_s) - from;
      const EffectInput input{0, step_s, from, {way / step_s, Vec3::Zero()}, 0.3, 1e-5, 0, Vec3::Zero()};
      work += effect.wrench_on_tool_O(input, memory).f.dot(way);
    }
    return std::abs(work);
  };
  EXPECT_LT(net_j(1e-4), 1e-7);
  EXPECT_LT(net_j(1e-4), net_j(1e-3) / 30);
}

TEST(EffectEnergy, PassiveEffectsNeverSpeedUpAFreeTool) {
  for (const EffectModel& model : models_where("label", "passive")) {
    const Effect effect(ball_with(model));
    const bool is_magnet = std::holds_alternative<Magnet>(model);
    for (const double mass_kg : kMasses_kg) {
      for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        Random random(seed);
        SteppedTool tool;
        tool.mass_kg = mass_kg;
        // For a magnet, the tool starts at the minimum of the potential. All of its energy is then kinetic.
        tool.p = is_magnet ? Vec3(0.005, 0, 0) : random_vec3(random, 0.02);
        tool.v = random_vec3(random, 0.3);
        const double start_j = tool.kinetic_j();
        for (int i = 0; i < 3000; ++i) {
          tool.step(effect);
          ASSERT_LE(tool.kinetic_j(), start_j + 1e-12) << name_of(model) << " mass " << mass_kg << " seed " << seed;
        }
      }
    }
  }
}

/// Returns the energy that a tool can recover: its kinetic energy plus the energy of the spring of stick-slip. If the
/// spring is stretched beyond the breakaway force, only its energy at that force counts.
double with_spring_j(const SteppedTool& tool, const StickSlip& model) {
  const double k = tool.memory.stiffness_n_per_m;
  const double pull_n = std::min(k * (tool.p - tool.memory.anchor_E).norm(), model.breakaway_force_n);
  return tool.kinetic_j() + 0.5 * pull_n * pull_n / k;
}

TEST(EffectEnergy, StickSlipAndItsSpringTogetherNeverGain) {
  const StickSlip model{2000, 1, 0.4};
  const Effect effect(effect_with(model));
  for (const double mass_kg : kMasses_kg) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Random random(seed);
      SteppedTool tool;
      tool.mass_kg = mass_kg;
      tool.v = random_vec3(random, 0.3);
      double energy_j = tool.kinetic_j();
      for (int i = 0; i < 500; ++i) {
        tool.step(effect);
        const double now_j = with_spring_j(tool, model);
        ASSERT_LE(now_j, energy_j + 1e-12) << "mass " << mass_kg << " seed " << seed << " step " << i;
        energy_j = now_j;
      }
    }
  }
}

TEST(EffectEnergy, AStickingToolThatGetsHeavierGainsNothing) {
  const Effect effect(effect_with(StickSlip{1e5, 1, 0.4}));
  SteppedTool tool;
  tool.mass_kg = 0.005;
  tool.step(effect);
  tool.p.x() = 3e-4;
  tool.step(effect);
  const double before_j = 0.5 * tool.memory.stiffness_n_per_m * (tool.p - tool.memory.anchor_E).squaredNorm();
  tool.mass_kg = 2;
  tool.v = Vec3::Zero();
  effect.wrench_on_tool_O(tool.input(), tool.memory);
  EXPECT_LE(0.5 * tool.memory.stiffness_n_per_m * (tool.p - tool.memory.anchor_E).squaredNorm(), before_j);
}

TEST(EffectEnergy, AConstantFieldPaysForEachTurnRoundItsEdge) {
  EffectSettings settings = effect_with(ConstantField{{1, 0, 0}});
  settings.region = BoxRegion{{1, 0.02, 1}};
  const Effect effect(settings);
  EffectMemory memory;
  double work_j = 0;
  constexpr int kSteps = 1000;
  for (const bool is_inside : {true, false}) {
    for (int i = 0; i < kSteps; ++i) {
      const Vec3 way(is_inside ? 1e-4 : -1e-4, 0, 0);
      EffectInput input;
      input.p_OT = {0, is_inside ? 0.0 : 0.05, 0};
      work_j += effect.wrench_on_tool_O(input, memory).f.dot(way);
    }
  }
  EXPECT_NEAR(work_j, 1.0 * kSteps * 1e-4, 1e-12) << "force times the way inside: 0.1 J a turn";
}

TEST(EffectEnergy, VibrationDoesTheWorkOfASinusoidOnADamper) {
  constexpr double kHz = 20, kAmplitude_n = 0.5, kStiffness = 300, kDamping = 5, kMass_kg = 0.05;
  const Effect effect(effect_with(Vibration{kHz, kAmplitude_n, 0, Vec3::UnitX()}));
  SteppedTool tool;
  tool.step_s = 1e-5;  // small enough for the closed form in continuous time
  tool.mass_kg = kMass_kg;
  double work_j = 0;
  constexpr int kSettle = 50000, kMeasure = 100000;  // 10 periods and 20 periods
  for (int i = 0; i < kSettle + kMeasure; ++i) {
    const Vec3 from = tool.p;
    const Vec3 f = tool.step_to(effect, Vec3::Zero(), kStiffness, kDamping);
    if (i >= kSettle) work_j += f.dot(tool.p - from);
  }
  const double omega = kTurn * kHz, reactance = kMass_kg * omega - kStiffness / omega;
  const double power_w = 0.5 * kAmplitude_n * kAmplitude_n * kDamping / (kDamping * kDamping + reactance * reactance);
  EXPECT_NEAR(work_j / (kMeasure * tool.step_s), power_w, 0.01 * power_w);
}

/// Returns the work on a path over one crest and down again. `press` gives the normal force on the way up and down.
double texture_work_j(const std::function<double(bool is_uphill)>& press) {
  const Effect effect(effect_with(Texture{2e-4, 4e-3, 0}));
  EffectMemory memory;
  double work_j = 0;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i) {
    const double way_m = 4e-3 / kSteps;
    // The height a sin(2πx/λ) rises in the first and the last quarter of a period.
    const bool is_uphill = i < kSteps / 4 || i >= 3 * kSteps / 4;
    const EffectInput input{0,   1e-3, {way_m * i, 0, 0}, {{way_m / 1e-3, 0, 0}, Vec3::Zero()},
                            0.3, 1e-5, press(is_uphill),  Vec3::UnitZ()};
    work_j += effect.wrench_on_tool_O(input, memory).f.x() * way_m;
  }
  return work_j;
}

TEST(EffectEnergy, TextureIsConservativeOnlyAtConstantPressure) {
  EXPECT_NEAR(texture_work_j([](bool) { return 1.0; }), 0, 1e-12);
  // A texture of the height a = 0.2 mm. The tool moves down by 2a while it presses with 1 N, and up by 2a while it
  // presses with 0.5 N. It gains the difference of the two works.
  EXPECT_NEAR(texture_work_j([](bool is_uphill) { return is_uphill ? 0.5 : 1.0; }), 0.5 * 2 * 2e-4, 1e-8);
}

}  // namespace
}  // namespace tandem::physics
