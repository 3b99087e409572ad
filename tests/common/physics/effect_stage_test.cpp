// Tests effects in the world: the forces on a hand, and the motion of the bodies that carry effects.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::physics {
namespace {

constexpr double kEffectStep_s = 1e-3;
constexpr double kStiffness = 300;
constexpr const char* kCoupling =
    R"({"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 5, "force_limit_n": 100})";
constexpr const char* kToolAtOrigin = R"({"name": "t"})";
/// A body far below the tools, because a scene needs at least one body.
constexpr const char* kGround =
    R"({"name": "ground", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -9]}})";

RigidState resting_at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, {v, Vec3::Zero()}};
}

/// A world with one tool at the origin, inside an effect of the scene.
World world_in(const std::string& effect) {
  return server::make_server_world(load_parts(
      {.bodies = kGround, .tools = kToolAtOrigin, .coupling = kCoupling, .rest = R"("effects": [)" + effect + "]"}));
}

/// Returns a weightless body of 4 cm at `x_m` that owns `effect`.
std::string floating_body(const std::string& name, double x_m, double mass_kg, const std::string& effect) {
  return R"({"name": ")" + name + R"(", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "gravity": false,
             "graspable": true, "mass_kg": )" +
         std::to_string(mass_kg) + R"(, "placement": {"position_m": [)" + std::to_string(x_m) +
         R"(, 0, 0]}, "effects": [)" + effect + "]}";
}

void hold(World& world, std::size_t tool, const Vec3& p, int steps) {
  world.set_handle(tool, resting_at(p));
  for (int i = 0; i < steps; ++i) ASSERT_EQ(world.step(), 0U);
}

TEST(EffectStage, ATubOfFluidDragsAToolBehindTheHandByItsClosedForm) {
  World world = world_in(R"({"viscosity": {"damping_n_s_per_m": 6}})");
  world.activate_tool(0);
  constexpr double kSpeed = 0.1;
  for (int i = 1; i <= 1000; ++i) {
    world.set_handle(0, resting_at({kSpeed * kEffectStep_s * i, 0, 0}, {kSpeed, 0, 0}));
    ASSERT_EQ(world.step(), 0U);
  }
  // Steady state: the spring k of the coupling balances the drag b v of the fluid, k (x_hand − x_tool) = b v. The
  // coupling's damper has no force, because hand and tool have the same velocity.
  const ToolState tool = world.tool(0);
  EXPECT_NEAR(kSpeed - tool.tool.X.p.x(), 6 * kSpeed / kStiffness, 1e-6);
  EXPECT_NEAR(tool.wrench_on_hand_W.f.x(), -6 * kSpeed, 1e-4);
}

TEST(EffectStage, OverlappingFluidsNeverTurnAToolBack) {
  std::string many;
  for (int i = 0; i < 20; ++i) many += std::string(i > 0 ? ", " : "") + R"({"viscosity": {"damping_n_s_per_m": 1000}})";
  World world = world_in(many);
  world.activate_tool(0);
  world.set_handle(0, resting_at({0.05, 0, 0}));
  double last = 0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(world.step(), 0U);
    const double x = world.tool(0).tool.X.p.x();
    ASSERT_GE(x, last);
    last = x;
  }
  EXPECT_GT(last, 0);
  EXPECT_LT(last, 0.05);
}

TEST(EffectStage, WindBlowsAToolAsideByForceOverStiffness) {
  World world = world_in(R"({"constant_field": {"force_n": [0.6, 0, -0.9]}})");
  world.activate_tool(0);
  hold(world, 0, Vec3::Zero(), 2000);
  EXPECT_LT((world.tool(0).tool.X.p - Vec3(0.6, 0, -0.9) / kStiffness).norm(), 1e-9);
  EXPECT_LT((world.tool(0).wrench_on_hand_W.f - Vec3(0.6, 0, -0.9)).norm(), 1e-6);
}

TEST(EffectStage, AFloatingToolIsNotBlownAway) {
  World world = world_in(R"({"constant_field": {"force_n": [0.6, 0, 0]}})");
  world.activate_tool(0);
  for (int i = 0; i < 1000; ++i) world.step();
  EXPECT_EQ(world.tool(0).tool.X.p, Vec3::Zero()) << "no hand has moved it yet";
}

TEST(EffectStage, AMagnetHoldsAToolAgainstTheHandUpToItsPeak) {
  World world = world_in(R"({"magnet": {"peak_force_n": 2, "range_m": 0.03}})");
  world.activate_tool(0);
  hold(world, 0, {0.006, 0, 0}, 3000);
  // Equilibrium of magnet and coupling: k_m (1 − s²)² x = k (x_hand − x), with s = x/range and the coupling's stiffness
  // k. The magnet's stiffness is k_m = peak force / (0.2862 · range), with a peak force of 2 N and a range of 0.03 m.
  const double x = world.tool(0).tool.X.p.x(), s2 = std::pow(x / 0.03, 2);
  EXPECT_NEAR(2 / (16 / (25 * std::sqrt(5.0)) * 0.03) * (1 - s2) * (1 - s2) * x, kStiffness * (0.006 - x), 1e-6);
  EXPECT_LT(x, 0.0036);
  hold(world, 0, {0.06, 0, 0}, 3000);
  EXPECT_NEAR(world.tool(0).tool.X.p.x(), 0.06, 1e-9) << "beyond its range it is free";
}

double amplitude_at(const std::vector<double>& samples, double hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    sum += samples[i] * std::polar(1.0, -2 * std::numbers::pi * hz * kEffectStep_s * static_cast<double>(i));
  }
  return 2 * std::abs(sum) / static_cast<double>(samples.size());
}

TEST(EffectStage, VibrationReachesTheHandAtItsFrequencyAndNoOther) {
  World world = world_in(R"({"vibration": {"frequency_hz": 80, "amplitude_n": 0.8}})");
  world.activate_tool(0);
  hold(world, 0, Vec3::Zero(), 1000);
  std::vector<double> force;
  for (int i = 0; i < 1000; ++i) {
    world.step();
    force.push_back(world.tool(0).wrench_on_hand_W.f.z());
  }
  const double amplitude_n = amplitude_at(force, 80);
  // The tool's mass m attenuates the vibration that the hand feels. The factor is |k + i b ω| / |k − m ω² + i b ω|,
  // with the coupling's stiffness k and damping b at the angular frequency ω. For 50 g and 80 Hz it is 0.20.
  EXPECT_NEAR(amplitude_n, 0.20 * 0.8, 0.01 * 0.8);
  for (const double hz : {20, 40, 79, 81, 120, 160, 240}) EXPECT_LT(amplitude_at(force, hz), 0.01 * amplitude_n) << hz;
}

TEST(EffectStage, APlateBuzzesOnlyWhileItIsTouched) {
  const std::string plate =
      R"({"name": "plate", "shapes": [{"box": {"size_m": [0.2, 0.2, 0.02]}}],
          "placement": {"position_m": [0, 0, -0.02]},
          "effects": [{"vibration": {"frequency_hz": 80, "amplitude_n": 0.8, "direction": [1, 0, 0]}}]})";
  World world(server::make_server_world(load_parts({.bodies = plate, .tools = kToolAtOrigin, .coupling = kCoupling})));
  world.activate_tool(0);
  const auto largest_shake = [&world](const Vec3& hand) {
    hold(world, 0, hand, 1000);
    double largest = 0;
    for (int i = 0; i < 100; ++i) {
      world.step();
      largest = std::max(largest, std::abs(world.tool(0).wrench_on_hand_W.f.x()));
    }
    return largest;
  };
  EXPECT_LT(largest_shake({0, 0, 0.01}), 1e-9);
  EXPECT_GT(largest_shake({0, 0, -0.0075}), 0.02);
  EXPECT_LT(largest_shake({0, 0, 0.01}), 1e-9);
}

TEST(EffectStage, AGratingIsFeltAtItsPeriodAndAPadSticks) {
  const auto swept = [](const std::string& effect) {
    const std::string plate =
        R"({"name": "plate", "friction": 0, "shapes": [{"box": {"size_m": [0.2, 0.2, 0.02]}}],
            "placement": {"position_m": [0, 0, -0.015]}, "effects": [)" +
        effect + "]}";
    World world(
        server::make_server_world(load_parts({.bodies = plate, .tools = kToolAtOrigin, .coupling = kCoupling})));
    world.activate_tool(0);
    hold(world, 0, {0, 0, -0.004}, 500);
    std::vector<double> force;
    for (int i = 0; i < 1000; ++i) {
      world.set_handle(0, resting_at({3e-5 * i, 0, -0.004}, {0.03, 0, 0}));
      world.step();
      force.push_back(world.tool(0).wrench_on_hand_W.f.x());
    }
    return force;
  };
  // A texture with a period of 3 mm and a height of 0.1 mm is swept at 0.03 m/s, which gives 10 Hz. Its steepest slope
  // is 0.1 mm · 2π/3 mm. The tool is pressed with 1.2 N, so the amplitude of the force is 1.2 N times this slope, 0.25
  // N.
  const auto grating = swept(R"({"texture": {"height_m": 0.0001, "period_x_m": 0.003}})");
  EXPECT_NEAR(amplitude_at(grating, 10), 0.25, 0.05);
  EXPECT_LT(amplitude_at(grating, 7), 0.02);
  const auto pad = swept(R"({"stick_slip": {"breakaway_force_n": 1, "slip_force_n": 0.4}})");
  EXPECT_GT(*std::max_element(pad.begin(), pad.end()), -0.4) << "after letting go";
  EXPECT_NEAR(*std::min_element(pad.begin(), pad.end()), -1, 0.05);
}

constexpr const char* kMassless = R"({"law": "qsa-static", "stiffness_n_per_m": 300, "force_limit_n": 6.5})";

/// Lets the hand rest at `hand` for two seconds. Returns the largest motion of the tool per step after that.
double unrest_m(World& world, const Vec3& hand) {
  hold(world, 0, hand, 2000);
  double largest = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 before = world.tool(0).tool.X.p;
    EXPECT_EQ(world.step(), 0U);
    largest = std::max(largest, (world.tool(0).tool.X.p - before).norm());
  }
  return largest;
}

// A massless tool is where coupling and effect balance. Each effect is stiffer than the coupling k, so the plain
// iteration x ← x_H + f(x)/k from the handle x_H would diverge.
TEST(EffectStage, StiffEffectsDoNotMakeAMasslessToolChatter) {
  const std::string magnet = R"({"magnet": {"peak_force_n": 3, "range_m": 0.01}})";
  const std::string stick = R"({"stick_slip": {"stiffness_n_per_m": 100000, "breakaway_force_n": 2}})";
  for (const std::string& effects : {magnet, stick, magnet + "," + stick}) {
    World world(server::make_server_world(load_parts({.bodies = kGround,
                                                      .tools = kToolAtOrigin,
                                                      .coupling = kMassless,
                                                      .rest = R"("effects": [)" + effects + "]"})));
    world.activate_tool(0);
    hold(world, 0, {0.002, 0, 0}, 50);
    EXPECT_LT(unrest_m(world, {0.004, 0.002, 0}), 1e-9) << effects;
    EXPECT_GT(world.tool(0).wrench_on_hand_W.f.norm(), 0.1) << "it is felt: " << effects;
  }
}

TEST(EffectStage, ASteepGratingMakesNoMasslessToolChatter) {
  const std::string plate =
      R"({"name": "plate", "friction": 0, "shapes": [{"box": {"size_m": [0.2, 0.2, 0.02]}}],
          "placement": {"position_m": [0, 0, -0.015]}, "effects": [
            {"texture": {"height_m": 0.0005, "period_x_m": 0.001}}]})";
  World world(server::make_server_world(load_parts({.bodies = plate, .tools = kToolAtOrigin, .coupling = kMassless})));
  world.activate_tool(0);
  hold(world, 0, {0, 0, -0.004}, 100);
  for (const double x : {0.0002, 0.0007, 0.003}) EXPECT_LT(unrest_m(world, {x, 0, -0.004}), 1e-8) << x;
}

TEST(EffectStage, FluidsDragAMasslessToolWithTheirCoefficients) {
  World world(server::make_server_world(load_parts({.bodies = kGround,
                                                    .tools = kToolAtOrigin,
                                                    .coupling = kMassless,
                                                    .rest = R"("effects": [{"viscosity": {"damping_n_s_per_m": 6}},
                                                 {"viscosity": {"damping_n_s_per_m": 2}}])"})));
  world.activate_tool(0);
  constexpr double kSpeed = 0.1;
  double last_x = 0;
  for (int i = 1; i <= 1000; ++i) {
    world.set_handle(0, resting_at({kSpeed * kEffectStep_s * i, 0, 0}, {kSpeed, 0, 0}));
    ASSERT_EQ(world.step(), 0U);
    ASSERT_GE(world.tool(0).tool.X.p.x(), last_x) << "never turned back";
    last_x = world.tool(0).tool.X.p.x();
  }
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.x(), -8 * kSpeed, 1e-3);
  hold(world, 0, {kSpeed, 0, 0}, 1000);
  EXPECT_LT(world.tool(0).wrench_on_hand_W.f.norm(), 1e-6) << "at rest it is not felt";
}

TEST(EffectStage, AMasslessToolInAFluidIsStoppedByAWallAndNotByTheFluid) {
  const std::string wall = R"({"name": "wall", "friction": 0, "shapes": [{"box": {"size_m": [0.1, 0.1, 0.1]}}],
                               "placement": {"position_m": [0, 0, -0.055]}})";
  World world(
      server::make_server_world(load_parts({.bodies = wall,
                                            .tools = kToolAtOrigin,
                                            .coupling = kMassless,
                                            .rest = R"("effects": [{"viscosity": {"damping_n_s_per_m": 8}}])"})));
  world.activate_tool(0);
  hold(world, 0, {0, 0, -0.01}, 2000);
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), world.touch(0).force_n, 1e-6);
  EXPECT_GT(world.touch(0).force_n, 2);
}

TEST(EffectStage, AFluidThatMovesDragsAMasslessToolAlongAndIsDraggedBack) {
  const std::string body =
      floating_body("carrier", 0, 0.2, R"({"sphere": {"radius_m": 0.5}, "viscosity": {"damping_n_s_per_m": 0.6}})");
  World world(server::make_server_world(load_parts(
      {.bodies = body,
       .tools = R"({"name": "t", "placement": {"position_m": [0, 0, 0.1]}}, {"name": "c", "holds": "carrier"})",
       .coupling = R"({"law": "qsa-static", "stiffness_n_m_per_rad": 300})"})));
  world.activate_tool(0);
  world.activate_tool(1);
  world.set_handle(0, resting_at({0, 0, 0.1}));
  for (int i = 1; i <= 2000; ++i) {
    world.set_handle(1, resting_at({5e-5 * i, 0, 0}, {0.05, 0, 0}));
    ASSERT_EQ(world.step(), 0U);
  }
  const double drag_n = 0.6 * 0.05;
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.x(), drag_n, 1e-3 * drag_n);
  EXPECT_NEAR(world.tool(1).wrench_on_hand_W.f.x(), -drag_n, 0.01 * drag_n);
}

TEST(EffectStage, ABodyInTwoHandsFeelsAnEffectOnce) {
  const std::string body = floating_body("carried", 0, 0.2, "");
  const std::string tools = R"({"name": "l", "holds": "carried", "placement": {"position_m": [-0.02, 0, 0]}},
                               {"name": "r", "holds": "carried", "placement": {"position_m": [0.02, 0, 0]}})";
  for (const char* law : {"spring-damper", "qsa-static"}) {
    World world(server::make_server_world(
        load_parts({.bodies = body,
                    .tools = tools,
                    .coupling = coupling_with(law),
                    .rest = R"("effects": [{"constant_field": {"force_n": [0, 0.9, 0]}}])"})));
    world.activate_tool(0);
    world.activate_tool(1);
    world.set_handle(1, resting_at({0.02, 0, 0}));
    hold(world, 0, {-0.02, 0, 0}, 3000);
    const double felt_n = world.tool(0).wrench_on_hand_W.f.y() + world.tool(1).wrench_on_hand_W.f.y();
    EXPECT_NEAR(felt_n, 0.9, 1e-3) << law;
  }
}

// The coupling has a large rotational stiffness, because the field rotates with the body that owns it.
TEST(EffectStage, AnEffectTravelsWithItsBody) {
  const std::string body = floating_body(
      "carrier", 0.3, 0.2, R"({"sphere": {"radius_m": 0.06}, "constant_field": {"force_n": [0, 0.9, 0]}})");
  World world(server::make_server_world(
      load_parts({.bodies = body,
                  .tools = std::string(kToolAtOrigin) +
                           R"(, {"name": "c", "holds": "carrier", "placement": {"position_m": [0.3, 0, 0]}})",
                  .coupling = R"({"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 5,
                                          "stiffness_n_m_per_rad": 300, "damping_n_m_s_per_rad": 0.5})"})));
  world.activate_tool(0);
  world.activate_tool(1);
  world.set_handle(1, resting_at({0.3, 0, 0}));
  hold(world, 0, Vec3::Zero(), 1000);
  EXPECT_LT(world.tool(0).tool.X.p.norm(), 1e-9) << "far away";
  for (int i = 0; i < 2500; ++i) {
    world.set_handle(1, resting_at({0.3 - 1e-4 * i, 0, 0}));
    world.step();
  }
  hold(world, 0, Vec3::Zero(), 4000);
  EXPECT_NEAR(world.tool(0).tool.X.p.y(), 0.9 / kStiffness, 1e-6);
  // The reaction pushes the carrier, and thus the hand that holds the carrier.
  EXPECT_NEAR(world.tool(1).tool.X.p.y(), -0.9 / kStiffness, 1e-5);
  EXPECT_NEAR(world.tool(1).wrench_on_hand_W.f.y(), -0.9, 1e-3)
      << "the holder must feel the reaction, but not the effects of the held body";
}

TEST(EffectStage, AFluidThatMovesDragsAToolAlong) {
  const std::string body =
      floating_body("carrier", 0, 0.2, R"({"sphere": {"radius_m": 0.5}, "viscosity": {"damping_n_s_per_m": 0.6}})");
  World world(server::make_server_world(load_parts(
      {.bodies = body,
       .tools = R"({"name": "t", "placement": {"position_m": [0, 0, 0.1]}}, {"name": "c", "holds": "carrier"})",
       .coupling = kCoupling})));
  world.activate_tool(0);
  world.activate_tool(1);
  world.set_handle(0, resting_at({0, 0, 0.1}));
  for (int i = 1; i <= 2000; ++i) {
    world.set_handle(1, resting_at({1e-4 * i, 0, 0}, {0.1, 0, 0}));
    ASSERT_EQ(world.step(), 0U);
  }
  EXPECT_NEAR(world.tool(0).tool.X.p.x(), 0.6 * 0.1 / kStiffness, 1e-6);
}

TEST(EffectStage, TheForceOfAnEffectOnAToolAndOnItsBodyAreOpposite) {
  const std::string magnet = R"({"magnet": {"peak_force_n": 0.5, "range_m": 0.2}})";
  World world(server::make_server_world(load_parts({.bodies = floating_body("free", 0.12, 0.2, magnet),
                                                    .tools = kToolAtOrigin,
                                                    .coupling = R"({"law": "spring-damper", "stiffness_n_per_m": 0,
                                     "damping_n_s_per_m": 0})"})));
  world.activate_tool(0);
  world.set_handle(0, resting_at(Vec3::Zero()));
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(world.step(), 0U);
    const Vec3 momentum = 0.05 * world.tool(0).tool.V.v + 0.2 * world.body(BodyId{1}).V.v;
    ASSERT_LT(momentum.norm(), 1e-14) << "step " << i;
  }
  EXPECT_GT(world.tool(0).tool.V.v.x(), 0.1);
  EXPECT_LT(world.body(BodyId{1}).V.v.x(), -0.02);
}

TEST(EffectStage, ShippedSceneStepsWithoutAFaultOrAnAllocationAndTwiceAlike) {
  const auto run = [](const std::shared_ptr<const server::LoadedScene>& scene) {
    World world(server::make_server_world(scene));
    world.activate_tool(0);
    world.activate_tool(1);
    TickFaults faults = 0;
    std::uint64_t allocations = 0;
    for (int i = 0; i < 6000; ++i) {
      // One hand moves down onto the plates and across their edges. The other hand moves through the bath and the wind.
      const double t = kEffectStep_s * i;
      const Vec3 left(-0.2 + 0.05 * std::max(0.0, t - 1), 0, std::max(0.007, 0.05 - 0.045 * t));
      const Vec3 right(0.2 - 0.02 * t, -0.05 * t, 0.05);
      world.set_handle(0, resting_at(left));
      world.set_handle(1, resting_at(right));
      const std::uint64_t before = test::allocation_count();
      faults |= world.step();
      allocations += test::allocation_count() - before;
    }
    EXPECT_EQ(faults, 0U);
    EXPECT_EQ(allocations, 0U);
    return std::pair(world.tool(0).tool.X.p, world.tool(1).tool.X.p);
  };
  const auto scene = server::load_scene(shipped_scene("effects"));
  EXPECT_EQ(run(scene), run(scene));
}

}  // namespace
}  // namespace tandem::physics
