// Tests coupling laws that change the tool's dynamics, in a running world. Each law has guarantees for tool, hand and
// touched bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "common/haptics/coupling/rendered_coupling.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

constexpr double kG = 9.81;
constexpr double kCouplingStep_s = 1e-3;

RigidState at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, Twist{v, Vec3::Zero()}};
}
void run_coupled(World& world, int steps) {
  for (int i = 0; i < steps; ++i) world.step();
}
std::string law(const std::string& name, const std::string& more = "") {
  return R"({"law": ")" + name + "\"" + more + "}";
}
/// A box whose top is at z = 0.
std::string block(const std::string& more = "") {
  return R"({"name": "block", "shapes": [{"box": {"size_m": [0.2, 0.2, 0.1]}}],
             "placement": {"position_m": [0, 0, -0.05]})" +
         more + "}";
}
std::string ball_at(double z, const std::string& name = "t") {
  return R"({"name": ")" + name + R"(", "placement": {"position_m": [0, 0, )" + std::to_string(z) + "]}}";
}

constexpr double kRadius_m = 0.005;  // radius of the ball that is the default shape of a tool

TEST(World, AToolIsPulledNoHarderThanItsUsersDeviceBearsUntilHeLeaves) {
  World world(server::make_server_world(
      load_parts({.tools = ball_at(1) + "," + ball_at(2, "u"), .coupling = law("spring-damper")})));
  haptics::CouplingParameters weak = haptics::kNoCouplingBounds;
  weak.stiffness_n_per_m = 100;
  weak.force_limit_n = 2;
  world.set_coupling_bounds(0, weak);
  for (const std::size_t tool : {0, 1}) world.activate_tool(tool);
  EXPECT_EQ(world.coupling(0).stiffness_n_per_m, 100);
  EXPECT_EQ(world.coupling(0).force_limit_n, 2);
  EXPECT_EQ(world.coupling(1).stiffness_n_per_m, haptics::CouplingParameters{}.stiffness_n_per_m);
  haptics::CouplingParameters strong;
  strong.stiffness_n_per_m = 900;
  world.set_coupling(strong);
  run_coupled(world, 1000);
  EXPECT_EQ(world.coupling(0).stiffness_n_per_m, 100) << "a coupling set later is bounded alike";
  EXPECT_EQ(world.coupling(1).stiffness_n_per_m, 900);
  weak.force_limit_n = std::numeric_limits<double>::quiet_NaN();
  world.set_coupling_bounds(0, weak);
  run_coupled(world, 1000);
  EXPECT_EQ(world.coupling(0).force_limit_n, 2);
  world.deactivate_tool(0);
  world.activate_tool(0);
  EXPECT_EQ(world.coupling(0).stiffness_n_per_m, 900) << "the next user has a different device";
}

const haptics::CouplingLawInfo& named(std::string_view name) {
  return *haptics::find_coupling_law(name);
}

/// Returns a world with two tools that are pressed 8 mm into a block. The second user's device limits the stiffness to
/// 150 N/m. The law `law_from_the_start` is set before both tools are activated.
std::unique_ptr<World> pressed(std::string_view law_from_the_start, std::string_view of_scene = haptics::kAdaptiveLaw) {
  const std::string beside = R"({"name": "u", "placement": {"position_m": [0.05, 0, 0.005]}})";
  std::unique_ptr<World> pressed(
      new World(server::make_server_world(load_parts({.bodies = block(),
                                                      .tools = ball_at(kRadius_m) + "," + beside,
                                                      .coupling = coupling_with(std::string(of_scene))}))));
  World& world = *pressed;
  world.set_coupling(named(law_from_the_start), {});
  haptics::CouplingParameters weak = haptics::kNoCouplingBounds;
  weak.stiffness_n_per_m = 150;
  world.set_coupling_bounds(1, weak);
  for (const std::size_t tool : {0, 1}) {
    world.activate_tool(tool);
    world.set_handle(tool, at({0.05 * static_cast<double>(tool), 0, kRadius_m - 0.008}));
  }
  run_coupled(world, 300);
  return pressed;
}
Vec3 on_hand_n(const World& world, std::size_t tool) {
  return world.tool(tool).wrench_on_hand_W.f;
}

TEST(World, AnotherLawUnderPressedToolsMakesNoStepAndIsThenAsFromTheStart) {
  for (const haptics::CouplingLawInfo& to : haptics::coupling_laws()) {
    const auto pressed_always = pressed(to.name);
    const World& always = *pressed_always;
    for (const haptics::CouplingLawInfo& from : haptics::coupling_laws()) {
      if (&from == &to || !haptics::are_exchangeable(from, to)) continue;
      const auto pressed_first = pressed(from.name);
      World& changed = *pressed_first;
      changed.set_coupling(to, {});
      for (int i = 0; i < 400; ++i) {
        const Vec3 before[] = {on_hand_n(changed, 0), on_hand_n(changed, 1)};
        changed.step();
        for (const std::size_t tool : {0, 1}) {
          ASSERT_LT((on_hand_n(changed, tool) - before[tool]).norm(), 0.02)
              << from.name << " to " << to.name << ", " << i;
        }
      }
      for (const std::size_t tool : {0, 1}) {
        const Vec3 wanted = on_hand_n(always, tool);
        ASSERT_GT(wanted.norm(), 0.1);
        EXPECT_LT((on_hand_n(changed, tool) - wanted).norm(), 0.001 * wanted.norm()) << from.name << " to " << to.name;
        EXPECT_EQ(changed.coupling(tool), always.coupling(tool)) << from.name << " to " << to.name;
      }
    }
  }
}

TEST(World, AToolActivatedDuringAFadeHasTheNewLawAtOnce) {
  const auto made = pressed("spring-damper");
  World& world = *made;
  world.set_coupling(named("stable-dynamic"), {});
  run_coupled(world, 100);
  world.deactivate_tool(0);
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, kRadius_m - 0.008}));
  run_coupled(world, 150);
  EXPECT_NEAR(on_hand_n(world, 0).z(), on_hand_n(*pressed("stable-dynamic"), 0).z(), 1e-3);
}

TEST(World, ALawWhoseToolIsAnotherIsIgnored) {
  for (const auto& [of_scene, wanted] :
       {std::pair{"spring-damper", "qsa-static"}, {"spring-damper", "direct"}, {"qsa-static", "spring-damper"}}) {
    const auto made = pressed(of_scene, of_scene);
    World& world = *made;
    const Vec3 before = on_hand_n(world, 0);
    world.set_coupling(named(wanted), {.stiffness_n_per_m = 900});
    run_coupled(world, 500);
    EXPECT_LT((on_hand_n(world, 0) - before).norm(), 1e-6) << of_scene << " to " << wanted;
  }
}

TEST(MasslessTool, IsAtTheHandleAfterAStepHoweverItMoves) {
  World world(server::make_server_world(load_parts({.coupling = law("qsa-static")})));
  world.activate_tool(0);
  for (int i = 0; i < 300; ++i) {
    // The speed of the handle is at most 0.6 m/s and reverses every 50 ms.
    const RigidState handle =
        at({0.01 * std::sin(60 * i * kCouplingStep_s), 0, 2}, {0.6 * std::cos(60 * i * kCouplingStep_s), 0, 0});
    world.set_handle(0, handle);
    EXPECT_EQ(world.step(), 0U);
    // The solver gives a massless tool a small mass. The tool therefore lags by 1e-4 of the handle's motion in a step,
    // which is at most 0.6 mm.
    ASSERT_LT((world.tool(0).tool.X.p - handle.X.p).norm(), 1e-7) << i;
    ASSERT_LT(world.tool(0).wrench_on_hand_W.f.norm(), 300 * 1e-7) << i;
  }
}

TEST(MasslessTool, PressedOnABoxRestsInAStepWhereCouplingAndContactBalance) {
  World world(server::make_server_world(
      load_parts({.bodies = block(), .tools = ball_at(kRadius_m + 5e-4), .coupling = law("qsa-static")})));
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, kRadius_m + 5e-4}));
  run_coupled(world, 3);
  const double inside_m = 0.005;
  world.set_handle(0, at({0, 0, kRadius_m - inside_m}));
  EXPECT_EQ(world.step(), 0U);
  const double first_n = world.tool(0).wrench_on_hand_W.f.z(), first_z = world.tool(0).tool.X.p.z();
  // The law has separate curves for pushing and for moving back. A handle at rest counts as pushing.
  const double stretch_m = first_z - (kRadius_m - inside_m);
  const double d_max = 6.5 / 300;
  EXPECT_NEAR(first_n, 6.5 * (1 - std::exp(-stretch_m / d_max)), 1e-4);
  EXPECT_NEAR(first_n, world.touch(0).force_n, 1e-4) << "the contact force must equal the coupling force";
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(world.step(), 0U);
    // The damper of the contact still moves the tool in the second step. From then on, the tool is at rest.
    ASSERT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), first_n, 0.02 * first_n) << i;
  }
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), world.touch(0).force_n, 1e-6);
  const double rest_z = world.tool(0).tool.X.p.z();
  run_coupled(world, 100);
  EXPECT_NEAR(world.tool(0).tool.X.p.z(), rest_z, 1e-9) << "no ringing";
}

TEST(MasslessTool, StaysWithoutAHandleAndWithoutASpring) {
  for (const char* spring : {"", R"(, "stiffness_n_per_m": 0, "stiffness_n_m_per_rad": 0)"}) {
    World world(server::make_server_world(load_parts({.coupling = law("qsa-static", spring)})));
    world.activate_tool(0);
    run_coupled(world, 100);
    EXPECT_EQ(world.tool(0).tool.X.p, Vec3(0, 0, 2)) << "no weight";
    world.set_handle(0, at({0.005, 0, 2}));
    for (int i = 0; i < 100; ++i) ASSERT_EQ(world.step(), 0U);
    world.clear_handle(0);
    const Vec3 p = world.tool(0).tool.X.p;
    run_coupled(world, 100);
    EXPECT_EQ(world.tool(0).tool.X.p, p) << "no memory of its velocity";
  }
}

TEST(MasslessTool, LeavesTheBodyThatItHoldsItsMass) {
  const std::string cube = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.1,
                               "graspable": true, "gravity": false})";
  World world(server::make_server_world(
      load_parts({.bodies = cube, .tools = R"({"name": "t", "holds": "a"})", .coupling = law("qsa-static")})));
  world.activate_tool(0);
  world.set_handle(0, at({0.01, 0, 0}));
  const Vec3 before = world.body(BodyId{1}).V.v;
  world.step();
  const Vec3 impulse = 0.1 * (world.body(BodyId{1}).V.v - before);
  EXPECT_GT(impulse.x(), 1e-3);
  EXPECT_LT((impulse + kCouplingStep_s * world.tool(0).wrench_on_hand_W.f).norm(), 1e-12);
}

/// A cube of 1 cm that is pressed on a block. Both are soft; their surfaces in series have 5e6 N/m³.
std::string flat_tool(double z) {
  return R"({"name": "t", "shapes": [{"box": {"size_m": [0.01, 0.01, 0.01]}}], "contact_stiffness_n_per_m3": 1e7,
             "placement": {"position_m": [0, 0, )" +
         std::to_string(z) + "]}}";
}

TEST(DirectRendering, ShowsTheContactsStiffnessAtTheHandlesPose) {
  World world(server::make_server_world(
      load_parts({.bodies = block(R"(, "contact_stiffness_n_per_m3": 1e7)"),
                  .tools = flat_tool(0.006),
                  .coupling = law("direct", R"(, "force_limit_n": 100, "saturation_softness": 0)")})));
  world.activate_tool(0);
  for (const double depth_m : {0.001, 0.003}) {
    world.set_handle(0, at({0, 0, 0.005 - depth_m}));
    run_coupled(world, 3);
    EXPECT_NEAR(world.tool(0).tool.X.p.z(), 0.005 - depth_m, 1e-12) << "the tool is where the handle is";
    // Each part of the cube's surface inside the block presses in proportion to its depth. The expected force therefore
    // includes the sides of the cube.
    const double expected_n = 5e6 * (1e-4 * depth_m + 0.04 * depth_m * depth_m / 2);
    EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), expected_n, 0.02 * expected_n);
    EXPECT_LT(world.tool(0).wrench_on_hand_W.f.head<2>().norm(), 1e-3);
  }
  world.set_handle(0, at({0, 0, 0.006}));
  run_coupled(world, 1);
  EXPECT_EQ(world.tool(0).wrench_on_hand_W.f, Vec3::Zero()) << "without contact there must be no force";
}

TEST(DirectRendering, IsLimitedAndNeverStopsTheTool) {
  World world(
      server::make_server_world(load_parts({.bodies = block(), .tools = ball_at(0.006), .coupling = law("direct")})));
  world.activate_tool(0);
  for (int i = 0; i < 60; ++i) {
    world.set_handle(0, at({0, 0, 0.006 - 5e-4 * i}));
    world.step();
    ASSERT_LE(world.tool(0).wrench_on_hand_W.f.norm(), 6.5);
    ASSERT_NEAR(world.tool(0).tool.X.p.z(), 0.006 - 5e-4 * i, 1e-9);
  }
  EXPECT_GT(world.tool(0).wrench_on_hand_W.f.norm(), 6.4);
}

TEST(DirectRendering, TheForceOnAFreeBodyIsOppositeToThatOnTheHand) {
  const std::string cube = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.3,
                               "gravity": false})";
  World world(server::make_server_world(
      load_parts({.bodies = cube,
                  .tools = R"({"name": "t", "placement": {"position_m": [-0.026, 0.004, 0.003]}})",
                  .coupling = law("direct", R"(, "force_limit_n": 1000, "saturation_softness": 0)")})));
  world.activate_tool(0);
  Vec3 given = Vec3::Zero();
  for (int i = 0; i < 300; ++i) {
    world.set_handle(0, at({-0.026 + 0.1 * i * kCouplingStep_s, 0.004, 0.003}));
    EXPECT_EQ(world.step(), 0U);
    given -= kCouplingStep_s * world.tool(0).wrench_on_hand_W.f;
  }
  EXPECT_GT(world.body(BodyId{1}).V.v.x(), 0.05);
  // Tolerance: residual that the solver may leave in the equation of each step (see ContactIsland).
  EXPECT_LT((0.3 * world.body(BodyId{1}).V.v - given).norm(), 300 * 1e-11 * 0.3);
}

TEST(DirectRendering, AHeldBodyIsAtTheHandleAndItsWeightIsShared) {
  const std::string cube = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2,
                               "graspable": true})";
  World world(server::make_server_world(
      load_parts({.bodies = cube,
                  .tools = R"({"name": "l", "holds": "a", "placement": {"position_m": [-0.02, 0, 0]}},
                                      {"name": "r", "holds": "a", "placement": {"position_m": [0.02, 0, 0]}})",
                  .coupling = law("direct")})));
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  world.set_handle(0, at({-0.02, 0, 0.005}));
  world.set_handle(1, at({0.02, 0, 0.005}));
  run_coupled(world, 10);
  EXPECT_NEAR(world.body(BodyId{1}).X.p.z(), 0.005, 1e-12);
  for (const std::size_t tool : {0U, 1U}) {
    EXPECT_NEAR(world.tool(tool).wrench_on_hand_W.f.z(), -0.1 * kG, 1e-9) << tool;
  }
}

/// Returns an adaptive fit with the stiffness of the thesis and a different damping.
std::string fit(const std::string& damping_n_s_per_m) {
  return R"(, "adaptive": {"mass_range_kg": [0.05, 0.2], "stiffness_n_per_m": [16.21, 116.53],
                           "damping_n_s_per_m": [)" +
         damping_n_s_per_m + "]}";
}
double fitted_n_per_m(double mass_kg) {
  return 16.21 + 116.53 * mass_kg;
}

TEST(AdaptiveCoupling, AHeldMassSagsByItsWeightOverItsOwnStiffness) {
  for (const double mass_kg : {0.06, 0.12, 0.2}) {
    const std::string cube = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "graspable": true,
                                 "mass_kg": )" +
                             std::to_string(mass_kg) + "}";
    World world(server::make_server_world(load_parts(
        {.bodies = cube, .tools = R"({"name": "t", "holds": "a"})", .coupling = law("adaptive", fit("4"))})));
    world.activate_tool(0);
    world.set_handle(0, at({0, 0, 0}));
    run_coupled(world, 3000);
    const double sag_m = mass_kg * kG / fitted_n_per_m(mass_kg);
    EXPECT_NEAR(-world.body(BodyId{1}).X.p.z(), sag_m, 0.02 * sag_m) << mass_kg << " kg";
  }
}

TEST(AdaptiveCoupling, AdaptsToGrabbedAndReleasedBodiesWithoutAForceStep) {
  const double mass_kg = 0.18, stretch_m = 0.03;
  const std::string cube = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "graspable": true,
                               "mass_kg": 0.18, "placement": {"position_m": [0, 0, 0.02]}})";
  World world(server::make_server_world(
      load_parts({.bodies = block() + "," + cube, .tools = ball_at(0.046), .coupling = law("adaptive", fit("0.4"))})));
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, 0.045 - stretch_m}));
  run_coupled(world, 2000);
  const auto force_n = [&] { return world.tool(0).wrench_on_hand_W.f.z(); };
  EXPECT_NEAR(force_n(), fitted_n_per_m(0.05) * stretch_m, 0.01) << "the tool's own mass";
  double last = force_n(), largest_step_n = 0;
  const auto watch = [&] {
    for (int i = 0; i < 500; ++i) {
      world.step();
      largest_step_n = std::max(largest_step_n, std::abs(force_n() - last));
      last = force_n();
    }
  };
  ASSERT_EQ(world.grab(0, BodyId{}), GrabResult::kGrabbed);
  watch();
  EXPECT_NEAR(force_n(), fitted_n_per_m(mass_kg) * stretch_m, 0.01) << "the held body's";
  world.release(0);
  watch();
  EXPECT_NEAR(force_n(), fitted_n_per_m(0.05) * stretch_m, 0.01);
  // The ramp changes the force by 1/100 of the whole change in each step. The bound is twice as large, because the
  // contact settles and the damper reacts to this motion.
  EXPECT_LT(largest_step_n, 0.02 * (fitted_n_per_m(mass_kg) - fitted_n_per_m(0.05)) * stretch_m);
}

}  // namespace
}  // namespace tandem::physics
