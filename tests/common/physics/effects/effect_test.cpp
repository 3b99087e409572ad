// Compares each effect with its closed form. Also tests effects at the edge of their region and with invalid input.
#include "common/physics/effects/effect.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/common/physics/effects/effect_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::physics {
namespace {

constexpr double kEffectTurn = 2 * std::numbers::pi;

Vec3 force_at(const Effect& effect, const Vec3& p, const Vec3& v = Vec3::Zero(), double time_s = 0) {
  EffectInput input;
  input.time_s = time_s;
  input.p_OT = p;
  input.V_OT.v = v;
  input.normal_force_n = 1;
  input.normal_O = Vec3::UnitZ();
  EffectMemory memory;
  return effect.wrench_on_tool_O(input, memory).f;
}

TEST(Effect, ForceAndTorqueStayFiniteAndBoundedForHostileInput) {
  const double values[] = {0,
                           -0.0,
                           1,
                           -1,
                           1e-320,
                           1e160,
                           -1e308,
                           std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()};
  const std::uint64_t seed = 20;
  Random random(seed);
  const auto any = [&] {
    return random.uniform() < 0.6 ? random.uniform(-0.05, 0.05) : values[random.next_u32() % std::size(values)];
  };
  for (const EffectModel& model : every_model()) {
    EffectSettings settings = ball_with(model);
    settings.force_limit_n = 0.7;
    settings.torque_limit_n_m = 0.002;
    const Effect effect(settings);
    EffectMemory memory;
    for (int i = 0; i < 10000; ++i) {
      const EffectInput input{any(),
                              std::abs(any()),
                              {any(), any(), any()},
                              {{any(), any(), any()}, {any(), any(), any()}},
                              std::abs(any()),
                              std::abs(any()),
                              any(),
                              {any(), any(), any()}};
      const Wrench wrench = effect.wrench_on_tool_O(input, memory);
      ASSERT_TRUE(is_finite(wrench)) << name_of(model) << " step " << i << " seed " << seed;
      ASSERT_LE(wrench.f.norm(), 0.7 * (1 + 1e-12)) << name_of(model);
      ASSERT_LE(wrench.t.norm(), 0.002 * (1 + 1e-12)) << name_of(model);
      ASSERT_TRUE(is_finite(memory.anchor_E)) << name_of(model);
    }
  }
}

TEST(Effect, FadesWithoutAJumpAtTheEdgesOfItsRegion) {
  constexpr double kStep_m = 1e-6;
  for (const EffectModel& model : every_model()) {
    EffectSettings settings = ball_with(model);
    settings.X_OE = {{0.1, 0, 0.2}, quaternion_of({0.3, 0.2, 0.1})};
    if (!std::holds_alternative<Magnet>(model)) settings.region = BoxRegion{{0.02, 0.03, 0.01}};
    // By design, the force of stick-slip jumps when the tool slips. With equal forces for breakaway and slip it must be
    // continuous.
    if (auto* stick_slip = std::get_if<StickSlip>(&settings.model)) stick_slip->slip_force_n = 1;
    const Effect effect(settings);
    EffectMemory memory;
    const Vec3 way = settings.X_OE.q * Vec3(0.8, 0.5, -0.3).normalized();
    Vec3 last = Vec3::Zero();
    double largest_jump = 0, largest = 0;
    for (int i = 0; i < 80000; ++i) {
      const EffectInput input{0.0025,
                              1e-3,
                              settings.X_OE.p + way * (-0.04 + kStep_m * i),
                              {0.1 * way, Vec3::Zero()},
                              0.05,
                              1e-5,
                              1,
                              settings.X_OE.q * Vec3::UnitZ()};
      const Vec3 f = effect.wrench_on_tool_O(input, memory).f;
      largest_jump = std::max(largest_jump, (f - last).norm());
      largest = std::max(largest, f.norm());
      last = f;
    }
    EXPECT_GT(largest, 0.1) << name_of(model) << " had no force";
    // The steepest effect has a slope of up to 700 N/m, so a step changes its force by 7e-4 N. A jump of the force
    // would exceed the bound.
    EXPECT_LT(largest_jump, 2e-3) << name_of(model);
    EXPECT_EQ(last, Vec3::Zero()) << name_of(model) << " reaches beyond its region";
  }
}

TEST(Effect, ContactEffectsRiseWithoutAJumpAsTheToolPresses) {
  for (const EffectModel& model : every_model()) {
    if (std::holds_alternative<Magnet>(model)) continue;
    EffectSettings settings = effect_with(model);
    settings.in_contact = true;
    const Effect effect(settings);
    EffectMemory memory;
    Vec3 last = Vec3::Zero();
    double largest_jump = 0;
    for (int i = -100; i < 10000; ++i) {
      const EffectInput input{0.0025, 1e-3, {1e-3, 0, 0}, {{0.1, 0, 0}, Vec3::Zero()},
                              0.05,   1e-5, 1e-4 * i,     Vec3::UnitZ()};
      const Vec3 f = effect.wrench_on_tool_O(input, memory).f;
      if (i <= 0) {
        ASSERT_EQ(f, Vec3::Zero()) << name_of(model) << " without contact";
      }
      largest_jump = std::max(largest_jump, (f - last).norm());
      last = f;
    }
    EXPECT_GT(last.norm(), 0.01) << name_of(model);
    EXPECT_LT(largest_jump, 3e-3) << name_of(model);
  }
}

TEST(Effect, ActsInTheAxesOfItsFrame) {
  EffectSettings settings = effect_with(ConstantField{{1, 0, 0}});
  settings.X_OE.q = quaternion_of({0, 0, std::numbers::pi / 2});
  EXPECT_LT((force_at(Effect(settings), {0.3, 0.1, 0}) - Vec3(0, 1, 0)).norm(), 1e-15);
}

TEST(Viscosity, IsExactAtConstantSpeedAndStopsALightToolInsteadOfTurningIt) {
  const Effect effect(effect_with(Viscosity{5, 0}));
  EXPECT_LT((force_at(effect, Vec3::Zero(), {0.2, 0, 0}) - Vec3(-1, 0, 0)).norm(), 1e-15);
  SteppedTool tool;
  // b h/m = 1.7 (damping b, step h, mass m). Without a limit of the damping, the tool would reverse.
  tool.mass_kg = 0.003;
  tool.v = {0.2, 0, 0};
  tool.step(effect);
  EXPECT_LT(tool.v.norm(), 1e-15);
}

TEST(Viscosity, SlowsAFreeToolByThePowerLawOfItsSteps) {
  const Effect effect(effect_with(Viscosity{5, 0}));
  SteppedTool tool;
  tool.v = {0.2, 0.1, 0};
  for (int i = 0; i < 10; ++i) tool.step(effect);
  EXPECT_NEAR(tool.v.x(), 0.2 * std::pow(1 - 5 * 1e-3 / 0.05, 10), 1e-15);
}

TEST(Viscosity, DampsRotationOnlyIfRequested) {
  EffectInput input;
  input.V_OT.w = {1, 2, 0};
  EffectMemory memory;
  EXPECT_EQ(Effect(effect_with(Viscosity{5, 0})).wrench_on_tool_O(input, memory).t, Vec3::Zero());
  const Vec3 t = Effect(effect_with(Viscosity{5, 0.005})).wrench_on_tool_O(input, memory).t;
  EXPECT_LT((t - Vec3(-0.005, -0.01, 0)).norm(), 1e-15);
}

TEST(Magnet, ForceIsTheSlopeOfABoundedPotentialAroundPointLineAndPlate) {
  Random random(3);
  for (const Vec3& core : {Vec3(0, 0, 0), Vec3(0.02, 0, 0), Vec3(0.02, 0.01, 0)}) {
    const Magnet magnet{2, 0.03, core};
    const Effect effect(effect_with(magnet));
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = random_vec3(random, 0.04);
      constexpr double kDelta_m = 1e-6;
      Vec3 slope;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 delta = kDelta_m * Vec3::Unit(axis);
        slope[axis] = (magnet_potential_j(magnet, p + delta) - magnet_potential_j(magnet, p - delta)) / (2 * kDelta_m);
      }
      // Tolerance of the finite difference. The core's nearest point may move across an edge of the core. There the
      // second derivative of the potential jumps by at most k = 233 N/m.
      EXPECT_LT((force_at(effect, p) + slope).norm(), 233 * kDelta_m);
    }
  }
}

TEST(Magnet, IsStrongestAtItsPeakAndZeroAtItsCentreAndBeyondItsRange) {
  const Effect effect(effect_with(Magnet{2, 0.03, Vec3::Zero()}));
  double strongest = 0;
  for (double x = 0; x < 0.04; x += 1e-5) strongest = std::max(strongest, force_at(effect, {x, 0, 0}).norm());
  EXPECT_NEAR(strongest, 2, 1e-6);
  EXPECT_NEAR(force_at(effect, {0.03 / std::sqrt(5.0), 0, 0}).x(), -2, 1e-12);
  EXPECT_EQ(force_at(effect, Vec3::Zero()), Vec3::Zero());
  EXPECT_EQ(force_at(effect, {0, 0.0301, 0}), Vec3::Zero());
}

TEST(Vibration, FollowsTheClockAndItsDirection) {
  const Effect effect(effect_with(Vibration{40, 0.5, 0, {0, 0, 0.2}}));
  for (const double t : {0.0, 0.001, 0.0123, 7.5}) {
    EXPECT_NEAR(force_at(effect, Vec3::Zero(), Vec3::Zero(), t).z(), 0.5 * std::sin(kEffectTurn * 40 * t), 1e-12);
  }
}

TEST(Vibration, RingsFromZeroEachTimeItIsEntered) {
  EffectSettings settings = effect_with(Vibration{50, 0.5, 0.02, Vec3::UnitX()});
  settings.region = SphereRegion{0.01};
  const Effect effect(settings);
  EffectMemory memory;
  for (const double entered_s : {1.0, 2.5}) {
    EffectInput input;
    for (int i = 0; i < 100; ++i) {
      input.time_s = entered_s + 1e-3 * i;
      const double since_s = input.time_s - entered_s;
      EXPECT_NEAR(effect.wrench_on_tool_O(input, memory).f.x(),
                  0.5 * std::exp(-since_s / 0.02) * std::sin(kEffectTurn * 50 * since_s), 1e-12);
    }
    input.p_OT = {1, 0, 0};
    effect.wrench_on_tool_O(input, memory);
  }
}

TEST(Texture, ForceIsTheSlopeOfTheBumpsTimesTheNormalForceAlongTheSurface) {
  EffectSettings settings = effect_with(Texture{2e-4, 4e-3, 3e-3});
  const Effect effect(settings);
  const double x = 0.0013, y = -0.0007;
  const Vec3 f = force_at(effect, {x, y, 0.02});
  EXPECT_NEAR(f.x(), -2e-4 * kEffectTurn / 4e-3 * std::cos(kEffectTurn * x / 4e-3), 1e-12);
  EXPECT_NEAR(f.y(), -2e-4 * kEffectTurn / 3e-3 * std::cos(kEffectTurn * y / 3e-3), 1e-12);
  EXPECT_EQ(f.z(), 0);
  EffectInput input;
  EffectMemory memory;
  EXPECT_EQ(effect.wrench_on_tool_O(input, memory).f, Vec3::Zero()) << "there is no contact";
}

TEST(Texture, FadesWhenBumpsPassFasterThanTheyAreSampled) {
  const Effect effect(effect_with(Texture{2e-4, 2e-3, 0}));
  const double slow = force_at(effect, Vec3::Zero(), {1e-4, 0, 0}).norm();
  EXPECT_NEAR(slow, 2e-4 * kEffectTurn / 2e-3, 1e-4 * slow);
  EXPECT_LT(force_at(effect, Vec3::Zero(), {2, 0, 0}).norm(), 1e-12 * slow) << "one period a step";
}

TEST(StickSlip, SlowDragIsASawtoothWithTheClosedFormOfTheAnchorsWork) {
  const StickSlip model{500, 1, 0.4};
  const Effect effect(effect_with(model));
  EffectMemory memory;
  EffectInput input;
  constexpr double kStep_m = 1e-7;
  double highest = 0, work_j = 0;
  int snaps = 0;
  double last = 0;
  // The spring of 500 N/m reaches the breakaway force of 1 N after 1/500 m. Then the tool slips until the spring has
  // 0.4 N. The next slips follow at intervals of (1 − 0.4)/500 m.
  constexpr int kSteps = 195000;
  for (int i = 0; i < kSteps; ++i) {
    input.p_OT.x() = kStep_m * i;
    const double f = -effect.wrench_on_tool_O(input, memory).f.x();
    if (f < last) {
      ++snaps;
      EXPECT_NEAR(f, 0.4, 1e-4);
    }
    last = f;
    highest = std::max(highest, f);
    work_j += f * kStep_m;
  }
  EXPECT_NEAR(highest, 1, 1e-4);
  EXPECT_EQ(snaps, 1 + static_cast<int>((kSteps * kStep_m - 0.002) / 0.0012));
  // The work must equal the energy lost when the tool slips plus the energy stored in the spring.
  const double taken_j = snaps * (1 - 0.4 * 0.4) / (2 * 500), stored_j = last * last / (2 * 500);
  EXPECT_NEAR(work_j, taken_j + stored_j, 1e-3 * work_j);
}

TEST(StickSlip, HoldsAToolUpToItsBreakawayForce) {
  const Effect effect(effect_with(StickSlip{500, 1, 0.4}));
  for (const double pull_n : {0.9, 1.1}) {
    SteppedTool tool;
    // The hand's spring is as stiff as the effect, so the hand moves twice as far as the tool.
    for (int i = 0; i < 3000; ++i) tool.step_to(effect, {2 * pull_n / 500 * std::min(1.0, i / 1000.0), 0, 0}, 500, 5);
    if (pull_n < 1) {
      EXPECT_NEAR(tool.p.x(), pull_n / 500, 1e-9);
    } else {
      EXPECT_GT(tool.p.x(), 1.05 * pull_n / 500) << "it let go";
    }
  }
}

TEST(StickSlip, OnASurfaceItDoesNotPullAlongTheNormal) {
  EffectSettings settings = effect_with(StickSlip{});
  settings.in_contact = true;
  const Effect effect(settings);
  EffectMemory memory;
  EffectInput input;
  input.normal_force_n = 1;
  input.normal_O = Vec3(1, 0, 1).normalized();
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    input.p_OT = random_vec3(random, 1e-3);
    input.V_OT.v = random_vec3(random, 0.3);
    EXPECT_NEAR(effect.wrench_on_tool_O(input, memory).f.dot(input.normal_O), 0, 1e-12);
  }
}

TEST(Effect, DoesNotAllocate) {
  std::vector<Effect> effects;
  for (const EffectModel& model : every_model()) effects.emplace_back(ball_with(model));
  EffectMemory memory;
  EffectInput input;
  input.normal_force_n = 1;
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 1000; ++i) {
    input.p_OT.x() = 1e-4 * (i % 300);
    for (const Effect& effect : effects) effect.wrench_on_tool_O(input, memory);
  }
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace tandem::physics
