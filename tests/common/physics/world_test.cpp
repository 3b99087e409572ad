// Compares the world with closed forms and with limits of human perception.
#include "server/room/server_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>

#include "common/base/random.hpp"
#include "proto/placement.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

constexpr double kWorldG = 9.81;
constexpr double kWorldStep_s = 1e-3;
constexpr const char* kTable =
    R"({"name": "table", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}})";

/// Returns a cube of 4 cm as JSON; `fields` contains additional fields.
std::string cube(const std::string& name, double mass_kg, const Vec3& p, const std::string& fields = "") {
  return R"({"name": ")" + name +
         R"(", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "graspable": true, "mass_kg": )" +
         std::to_string(mass_kg) + R"(, "placement": {"position_m": [)" + std::to_string(p.x()) + "," +
         std::to_string(p.y()) + "," + std::to_string(p.z()) + "]}" + fields + "}";
}
std::string tool_at(const std::string& name, const Vec3& p, const std::string& holds = "") {
  return R"({"name": ")" + name + R"(", "holds": ")" + holds + R"(", "placement": {"position_m": [)" +
         std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z()) + "]}}";
}
RigidState resting_at(const Vec3& p) {
  return {{p, Quat::Identity()}, Twist{}};
}

TickFaults step_times(World& world, int steps) {
  TickFaults faults = 0;
  for (int i = 0; i < steps; ++i) faults |= world.step();
  return faults;
}

TEST(World, FreeFallIsSymplecticEulersToTheRounding) {
  World world(server::make_server_world(load_parts({.bodies = cube("a", 0.1, {0, 0, 1})})));
  constexpr int kSteps = 300;
  step_times(world, kSteps);
  EXPECT_NEAR(world.body(BodyId{1}).V.v.z(), -kWorldG * kSteps * kWorldStep_s, 1e-12);
  EXPECT_NEAR(world.body(BodyId{1}).X.p.z(), 1 - kWorldG * kWorldStep_s * kWorldStep_s * kSteps * (kSteps + 1) / 2,
              1e-12);
}

TEST(World, ABodyWithoutGravityDoesNotMoveByABit) {
  World world(
      server::make_server_world(load_parts({.bodies = cube("a", 0.1, {0.1, 0.2, 0.3}, R"(, "gravity": false)")})));
  step_times(world, 100);
  EXPECT_EQ(world.body(BodyId{1}).X.p, Vec3(0.1, 0.2, 0.3));
}

TEST(World, DampingIsExponentialInTime) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.1, {0, 0, 1}, R"(, "gravity": false, "linear_damping_per_s": 4)"),
                  .tools = tool_at("t", {0, 0, 1}, "a"),
                  .coupling = R"({"law": "spring-damper", "damping_n_s_per_m": 0, "damping_n_m_s_per_rad": 0})"})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1.01}));
  step_times(world, 20);
  world.release(0);
  const double before = world.body(BodyId{1}).V.v.z();
  ASSERT_GT(before, 0.1);
  step_times(world, 250);
  EXPECT_NEAR(world.body(BodyId{1}).V.v.z(), before * std::exp(-1), 1e-9);
}

TEST(World, RestingBoxStaysPutAndGainsNoEnergy) {
  World world(
      server::make_server_world(load_parts({.bodies = std::string(kTable) + "," + cube("a", 0.2, {0, 0, 0.02})})));
  const double start = world.stored_energy_j();
  double highest = start;
  for (int i = 0; i < 3000; ++i) {
    world.step();
    highest = std::max(highest, world.stored_energy_j());
  }
  const RigidState box = world.body(BodyId{2});
  EXPECT_LT((box.X.p - Vec3(0, 0, 0.02)).norm(), 20e-6);
  EXPECT_LT(box.V.v.norm(), 1e-4);
  EXPECT_LT(box.X.q.angularDistance(Quat::Identity()), 1e-3);
  EXPECT_LE(highest, start + 1e-9);
}

TEST(World, DroppedBoxDoesNotBounceHigherThanItsRestitution) {
  World world(
      server::make_server_world(load_parts({.bodies = std::string(kTable) + "," + cube("a", 0.2, {0, 0, 0.12})})));
  double after_impact = 0;
  for (int i = 0; i < 2000; ++i) {
    world.step();
    if (i > 160) after_impact = std::max(after_impact, world.body(BodyId{2}).X.p.z());
  }
  // The restitution is 0, so the body must not bounce. It has fallen by 10 cm in 143 ms.
  EXPECT_LT(after_impact, 0.0205);
  EXPECT_NEAR(world.body(BodyId{2}).X.p.z(), 0.02, 5e-5);
}

/// Returns the distance that a cube slides on a table in 1 s. Gravity is rotated, as on a plane with the slope
/// `tangent`.
double slid_after_1_s(double tangent) {
  const double slope = std::atan(tangent);
  const std::string gravity = R"("gravity_m_per_s2": [)" + std::to_string(kWorldG * std::sin(slope)) + ", 0, " +
                              std::to_string(-kWorldG * std::cos(slope)) +
                              R"(], "limits": {"body_speed_m_per_s": 100})";
  const std::string table =
      R"({"name": "table", "shapes": [{"box": {"size_m": [20, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}})";
  World world(
      server::make_server_world(load_parts({.bodies = table + "," + cube("a", 0.2, {0, 0, 0.02}), .rest = gravity})));
  for (int i = 0; i < 1000; ++i) world.step();
  return world.body(BodyId{2}).X.p.x();
}

TEST(World, BoxSticksInsideTheFrictionCone) {
  // Both bodies have a friction coefficient of 0.5, so the coefficient of the pair is √(0.5·0.5) = 0.5.
  EXPECT_LT(std::abs(slid_after_1_s(0.45)), 1e-4);
}

TEST(World, ABoxOutsideOfTheFrictionConeSlidesByCoulombsLaw) {
  for (const double tangent : {0.6, 1.0}) {
    const double slope = std::atan(tangent);
    const double acceleration = kWorldG * (std::sin(slope) - 0.5 * std::cos(slope));
    EXPECT_NEAR(slid_after_1_s(tangent), 0.5 * acceleration, 0.02 * 0.5 * acceleration) << tangent;
  }
}

TEST(World, HeldBodySagsByItsWeightOverTheStiffness) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0, 0, 1}, "a")})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1}));
  step_times(world, 3000);
  const double weight = 0.12 * kWorldG;
  EXPECT_NEAR(1 - world.body(BodyId{1}).X.p.z(), weight / 300, 1e-9);
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), -weight, 1e-6);
  EXPECT_LT(world.tool(0).wrench_on_hand_W.f.head<2>().norm(), 1e-9);
}

TEST(World, TwoToolsThatHoldOneBodyShareItsWeight) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}),
                  .tools = tool_at("l", {-0.02, 0, 1}, "a") + "," + tool_at("r", {0.02, 0, 1}, "a")})));
  for (const std::size_t tool : {0U, 1U}) {
    world.activate_tool(tool);
    world.set_handle(tool, resting_at({tool == 0 ? -0.02 : 0.02, 0, 1}));
  }
  step_times(world, 4000);
  for (const std::size_t tool : {0U, 1U}) {
    EXPECT_NEAR(world.tool(tool).wrench_on_hand_W.f.z(), -0.5 * 0.12 * kWorldG, 1e-6);
    EXPECT_EQ(world.tool(tool).held, BodyId{1});
  }
}

TEST(World, ForceOnTheHandIsMinusTheChangeOfTheToolsMomentum) {
  World world(server::make_server_world(load_parts({})));
  world.activate_tool(0);
  world.set_handle(0, {{Vec3(0.005, 0.002, 2), Quat::Identity()}, {Vec3(0.1, 0, 0), Vec3::Zero()}});
  for (int i = 0; i < 50; ++i) {
    const Vec3 before = world.tool(0).tool.V.v;
    world.step();
    const ToolState after = world.tool(0);
    const Vec3 impulse = 0.05 * (after.tool.V.v - before);
    ASSERT_LT((impulse + after.wrench_on_hand_W.f * kWorldStep_s).norm(), 1e-15);
  }
}

TEST(World, WorkOfTheCouplingIsTheToolsKineticEnergyAndWhatSamplingAdds) {
  World world(server::make_server_world(load_parts({})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0.01, 0, 2}));
  double sampling = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 before = world.tool(0).tool.V.v;
    world.step();
    const ToolState tool = world.tool(0);
    // In a step h, the force F_k changes the velocity of the mass m from v_k to v_{k+1}. Its work is F_k·h·v_{k+1} = m
    // (v_{k+1} − v_k)·v_{k+1} = Δ(m v²/2) + m |Δv|²/2. The last term, summed in `sampling`, arises because the force is
    // held during a step.
    sampling += 0.5 * 0.05 * (tool.tool.V.v - before).squaredNorm();
    const double kinetic = 0.5 * 0.05 * tool.tool.V.v.squaredNorm();
    ASSERT_NEAR(tool.energy_into_world_j - tool.energy_from_world_j, kinetic + sampling, 1e-12) << i;
  }
  EXPECT_LT((world.tool(0).tool.X.p - Vec3(0.01, 0, 2)).norm(), 1e-9);
  EXPECT_GT(world.tool(0).energy_into_world_j, 1e-3);
}

TEST(World, ToolWithoutAHandleFloatsAndStops) {
  World world(server::make_server_world(load_parts({})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0.02, 0, 2}));
  step_times(world, 15);
  world.clear_handle(0);
  ASSERT_GT(world.tool(0).tool.V.v.norm(), 0.1);
  step_times(world, 1000);
  EXPECT_LT(world.tool(0).tool.V.v.norm(), 1e-6);
  EXPECT_NEAR(world.tool(0).tool.X.p.z(), 2, 1e-12) << "tools have no weight";
  EXPECT_EQ(world.tool(0).wrench_on_hand_W.f, Vec3::Zero());
}

TEST(World, BodyHeldByALostHandIsNotDropped) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0, 0, 1}, "a")})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1}));
  step_times(world, 500);
  const double held_at = world.body(BodyId{1}).X.p.z();
  world.clear_handle(0);
  step_times(world, 1000);
  EXPECT_NEAR(world.body(BodyId{1}).X.p.z(), held_at - 0.12 * kWorldG / 300, 1e-5);
  EXPECT_EQ(world.tool(0).held, BodyId{1});
}

/// Largest change of the force on the hand between consecutive steps.
struct ForceSteps {
  Vec3 last = Vec3::Zero();
  double largest_n = 0;
  void note_change(const World& world) {
    const Vec3 now = world.tool(0).wrench_on_hand_W.f;
    largest_n = std::max(largest_n, (now - last).norm());
    last = now;
  }
};

TEST(World, GrabAndReleaseMakeNoForceStep) {
  World world(server::make_server_world(load_parts(
      {.bodies = std::string(kTable) + "," + cube("a", 0.2, {0, 0, 0.02}), .tools = tool_at("t", {0, 0, 0.05})})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 0.041}));  // presses the box with about (45 − 41) mm · 300 N/m = 1.2 N
  step_times(world, 2000);
  ForceSteps steps;
  steps.last = world.tool(0).wrench_on_hand_W.f;
  EXPECT_NEAR(steps.last.z(), 1.2, 0.05);
  ASSERT_EQ(world.grab(0, BodyId{}), GrabResult::kGrabbed);
  EXPECT_EQ(world.tool(0).held, BodyId{2});
  for (int i = 0; i < 200; ++i) {
    world.step();
    steps.note_change(world);
  }
  world.release(0);
  for (int i = 0; i < 200; ++i) {
    world.step();
    steps.note_change(world);
  }
  // Tool and box are at rest. Only noise of the contact may still change the force, by way of the damper. The measured
  // change was 1e-6 N.
  EXPECT_LT(steps.largest_n, 1e-3);
}

TEST(World, ReleasedBodyIsNotKickedByTheToolInside) {
  World world(server::make_server_world(load_parts(
      {.bodies = cube("a", 0.2, {0, 0, 1}, R"(, "gravity": false)"), .tools = tool_at("t", {0, 0, 1}, "a")})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1}));
  step_times(world, 100);
  world.release(0);
  step_times(world, 500);
  EXPECT_LT((world.body(BodyId{1}).X.p - Vec3(0, 0, 1)).norm(), 1e-9) << "the tool starts in the body's centre";
  // The tool withdraws, then moves back and must touch the body again.
  for (int i = 0; i < 500; ++i) {
    world.set_handle(0, resting_at({0.0001 * i, 0, 1}));
    world.step();
  }
  for (int i = 500; i > 0; --i) {
    world.set_handle(0, resting_at({0.0001 * i, 0, 1}));
    world.step();
  }
  EXPECT_LT(world.body(BodyId{1}).X.p.x(), -0.005);
}

TEST(World, GrabTakesTheNearestGraspableBodyInReach) {
  const std::string ungraspable = R"({"name": "stone", "shapes": [{"sphere": {"radius_m": 0.01}}], "mass_kg": 1,
                                      "gravity": false, "placement": {"position_m": [0, 0, 0.02]}})";
  World world(server::make_server_world(
      load_parts({.bodies = ungraspable + "," + cube("far", 0.1, {-0.045, 0, 0}, R"(, "gravity": false)") + "," +
                            cube("near", 0.1, {0.04, 0, 0}, R"(, "gravity": false)") + "," +
                            cube("away", 0.1, {1, 0, 0}, R"(, "gravity": false)"),
                  .tools = tool_at("t", {0, 0, 0})})));
  EXPECT_EQ(world.grab(0, BodyId{}), GrabResult::kOutOfReach) << "no user has this tool yet";
  world.activate_tool(0);
  EXPECT_EQ(world.grab(0, BodyId{9}), GrabResult::kUnknownBody);
  EXPECT_EQ(world.grab(0, BodyId{1}), GrabResult::kNotGraspable);
  EXPECT_EQ(world.grab(0, BodyId{4}), GrabResult::kOutOfReach);
  // The surface of the tool is 20 mm from `far` and 15 mm from `near`; the reach is 20 mm. The nearer body must be
  // grabbed.
  EXPECT_EQ(world.grab(0, BodyId{}), GrabResult::kGrabbed);
  EXPECT_EQ(world.tool(0).held, BodyId{3});
  EXPECT_EQ(world.grab(0, BodyId{2}), GrabResult::kAlreadyHolding);
  world.release(0);
  EXPECT_EQ(world.grab(0, BodyId{2}), GrabResult::kGrabbed) << "a named body in reach, though not the nearest";
}

TEST(World, GrabAgreesWithTheDistanceToTheSurface) {
  // The reach of 20 mm is measured between the surfaces. The tool has a radius of 5 mm and the cube a half edge of 20
  // mm, so the centres may be 45 mm apart.
  for (const auto& [gap_m, expected] :
       {std::pair{0.0449, GrabResult::kGrabbed}, std::pair{0.0451, GrabResult::kOutOfReach}}) {
    World world(server::make_server_world(
        load_parts({.bodies = cube("a", 0.1, {gap_m, 0, 0}), .tools = tool_at("t", {0, 0, 0})})));
    world.activate_tool(0);
    EXPECT_EQ(world.grab(0, BodyId{1}), expected) << gap_m;
  }
}

TEST(World, ADeactivatedToolReleasesItsBodyAndIsRemoved) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0, 0, 1}, "a")})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1}));
  step_times(world, 100);
  world.deactivate_tool(0);
  EXPECT_FALSE(world.tool(0).held.is_valid());
  const double v = world.body(BodyId{1}).V.v.z();
  step_times(world, 100);
  EXPECT_NEAR(world.body(BodyId{1}).V.v.z(), v - kWorldG * 0.1, 1e-9) << "the body must fall freely";
}

TEST(World, NextUserFindsTheBodyInTheHandAgain) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0.01, 0, 1}, "a")})));
  world.activate_tool(0);
  world.deactivate_tool(0);
  step_times(world, 300);
  ASSERT_LT(world.body(BodyId{1}).X.p.z(), 0.6);
  world.activate_tool(0);
  EXPECT_EQ(world.body(BodyId{1}).X.p, Vec3(0, 0, 1));
  EXPECT_LT((world.tool(0).tool.X.p - Vec3(0.01, 0, 1)).norm(), 1e-15);
}

TEST(World, ABodyWaitsForTheToolThatHoldsItFromTheStart) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0.01, 0, 1}, "a")})));
  step_times(world, 300);
  EXPECT_EQ(world.body(BodyId{1}).X.p, Vec3(0, 0, 1));
  world.activate_tool(0);
  world.deactivate_tool(0);
  step_times(world, 300);
  EXPECT_LT(world.body(BodyId{1}).X.p.z(), 0.6) << "once held, it waits no more";
}

TEST(World, ManyHandsAndAWildCouplingStayCalm) {
  // Four hands hold a body of 20 g beside its centre. Explicit integration would be stable only with a fortieth of each
  // coupling's stiffness.
  std::string tools;
  for (const char* name : {"t0", "t1", "t2", "t3"}) {
    if (!tools.empty()) tools += ",";
    tools += tool_at(name, {0.022, 0.02, 1});
  }
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.02, {0, 0, 1}, R"(, "gravity": false)"), .tools = tools})));
  haptics::CouplingParameters wild;
  wild.stiffness_n_per_m = 1e6;
  wild.damping_n_s_per_m = 1e4;
  wild.damping_n_m_s_per_rad = 1e4;
  world.set_coupling(wild);
  for (std::size_t i = 0; i < 4; ++i) {
    world.activate_tool(i);
    ASSERT_EQ(world.grab(i, BodyId{1}), GrabResult::kGrabbed);
    world.set_handle(i, resting_at({0.023, 0.02, 1}));
  }
  step_times(world, 3000);
  EXPECT_LT(world.body(BodyId{1}).V.v.norm(), 1e-6);
  EXPECT_LT(world.body(BodyId{1}).V.w.norm(), 1e-4);
}

TEST(World, CouplingThatIsNotFiniteIsIgnored) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0, 0, 1}, "a")})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0, 0, 1}));
  haptics::CouplingParameters broken;
  broken.stiffness_n_per_m = std::numeric_limits<double>::quiet_NaN();
  world.set_coupling(broken);
  step_times(world, 3000);
  EXPECT_NEAR(1 - world.body(BodyId{1}).X.p.z(), 0.12 * kWorldG / 300, 1e-6);
}

TEST(World, RequestingACouplingAtEveryStepHasTheEffectOfOneRequest) {
  haptics::CouplingParameters other;
  other.stiffness_n_per_m = 900;
  const auto height_after = [&](int steps, bool sets_every_step, bool sets_before) {
    World world(server::make_server_world(
        load_parts({.bodies = cube("a", 0.12, {0, 0, 1}), .tools = tool_at("t", {0, 0, 1}, "a")})));
    if (sets_before) world.set_coupling(other);
    world.activate_tool(0);
    world.set_handle(0, resting_at({0, 0, 1}));
    for (int i = 0; i < steps; ++i) {
      if (i == 0 || sets_every_step) world.set_coupling(other);
      world.step();
    }
    return world.body(BodyId{1}).X.p.z();
  };
  // The height while a coupling is set in every step must equal that of a coupling that is set once. This must hold
  // during the ramp (40 steps) and long after it.
  for (const int steps : {40, 3000}) EXPECT_EQ(height_after(steps, true, false), height_after(steps, false, false));
  EXPECT_NEAR(1 - height_after(3000, true, false), 0.12 * kWorldG / 900, 1e-6);
  // A tool that is activated after the change has the new coupling at once, without a ramp.
  EXPECT_GT(height_after(40, true, true), height_after(40, true, false));
  EXPECT_NEAR(1 - height_after(3000, true, true), 0.12 * kWorldG / 900, 1e-6);
}

std::string wall_of_2_mm() {
  return R"({"name": "wall", "shapes": [{"box": {"size_m": [0.002, 0.5, 0.5]}}],
             "placement": {"position_m": [0.05, 0, 0]}})";
}

/// Moves the handle from 0 through the wall at 5 cm, then holds it. Returns the largest x that the tool reaches.
double deepest_x(World& world, double speed_m_per_s) {
  world.activate_tool(0);
  double deepest = -1;
  for (int i = 0; i < 1500; ++i) {
    const double x = std::min(0.3, speed_m_per_s * i * kWorldStep_s);
    world.set_handle(
        0, {{Vec3(x, 0.013, 0.007), Quat::Identity()}, {Vec3(x < 0.3 ? speed_m_per_s : 0, 0, 0), Vec3::Zero()}});
    world.step();
    deepest = std::max(deepest, world.tool(0).tool.X.p.x());
  }
  return deepest;
}

TEST(World, ToolDoesNotPassAWallOf2MillimetresAt1MetreASecond) {
  World world(server::make_server_world(load_parts({.bodies = wall_of_2_mm(), .tools = tool_at("t", {0, 0, 0})})));
  // The surface of the wall is at 49 mm, and the tool's radius is 5 mm. The tool may penetrate by at most its
  // displacement in one step, 1 mm.
  EXPECT_LT(deepest_x(world, 1.0), 0.045);
}

TEST(World, ToolDoesNotPassAnExactMeshWallAt1MetreASecond) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "tandem_world_wall.obj";
  std::ofstream(file) << "v 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nf 1 2 3\nf 1 3 4\n";
  World world(server::make_server_world(
      load_parts({.bodies = R"({"name": "wall", "shapes": [{"mesh": {"file": ")" + file.string() +
                            R"("}}], "placement": {"position_m": [0.05, 0, 0]}})",
                  .tools = tool_at("t", {0, 0, 0})})));
  std::filesystem::remove(file);
  EXPECT_LT(deepest_x(world, 1.0), 0.0465);
}

TEST(World, BodyThatIsNotFiniteIsPutBackAndReported) {
  auto scene = std::make_shared<server::LoadedScene>(*load_parts({.bodies = cube("a", 0.1, {0, 0, 1})}));
  // A gravity of NaN makes the state of the body not finite. It is set after loading, because the scene loader would
  // refuse it.
  scene->world.gravity_m_per_s2.x() = std::numeric_limits<double>::quiet_NaN();
  World world(server::make_server_world(scene));
  EXPECT_NE(world.step() & kFaultNotFinite, 0U);
  EXPECT_EQ(world.body(BodyId{1}).X.p, Vec3(0, 0, 1));
  EXPECT_EQ(world.body(BodyId{1}).V.v, Vec3::Zero());
}

TEST(World, HandleThatIsNotFiniteIsNotFollowed) {
  World world(server::make_server_world(load_parts({})));
  world.activate_tool(0);
  RigidState handle = resting_at({0, 0, 2});
  handle.X.p.x() = std::numeric_limits<double>::infinity();
  world.set_handle(0, handle);
  EXPECT_EQ(step_times(world, 10), 0U);
  EXPECT_EQ(world.tool(0).tool.X.p, Vec3(0, 0, 2));
}

TEST(World, FastBodyIsSlowedAndReported) {
  World world(server::make_server_world(
      load_parts({.bodies = cube("a", 0.1, {0, 0, 1}), .rest = R"("limits": {"body_speed_m_per_s": 0.5})"})));
  EXPECT_EQ(step_times(world, 50), 0U);
  EXPECT_EQ(step_times(world, 50), static_cast<TickFaults>(kFaultSpeedLimited));
  EXPECT_LE(world.body(BodyId{1}).V.v.norm(), 0.5 + 1e-12);
}

TEST(World, SaturatedCouplingIsReportedAndBounded) {
  World world(server::make_server_world(load_parts({})));
  world.activate_tool(0);
  world.set_handle(0, resting_at({0.5, 0, 2}));
  EXPECT_EQ(world.step(), static_cast<TickFaults>(kFaultCouplingSaturated));
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.norm(), 6.5, 1e-12);
}

TEST(World, OffCentreBodyTurnsAboutItsCentreOfMass) {
  // A pure torque rotates a dumb-bell whose body frame is in one of its balls. Its centre of mass must not move.
  const std::string body = R"({"name": "a", "mass_kg": 0.2, "gravity": false, "graspable": true, "shapes": [
      {"sphere": {"radius_m": 0.02}}, {"sphere": {"radius_m": 0.02}, "placement": {"position_m": [0.1, 0, 0]}}]})";
  World world(server::make_server_world(
      load_parts({.bodies = body,
                  .tools = tool_at("t", {0.05, 0, 0}, "a"),
                  .coupling = R"({"law": "spring-damper", "stiffness_n_per_m": 0, "damping_n_s_per_m": 0})"})));
  world.activate_tool(0);
  world.set_handle(0, {{Vec3(0.05, 0, 0), quaternion_of(Vec3(0, 0, 1))}, Twist{}});
  step_times(world, 300);
  const RigidState state = world.body(BodyId{1});
  EXPECT_GT(state.V.w.z(), 1);
  EXPECT_LT((state.X * Vec3(0.05, 0, 0) - Vec3(0.05, 0, 0)).norm(), 1e-9);
  EXPECT_LT((state.V.v - state.V.w.cross(state.X.q * Vec3(-0.05, 0, 0))).norm(), 1e-9);
}

}  // namespace
}  // namespace tandem::physics
