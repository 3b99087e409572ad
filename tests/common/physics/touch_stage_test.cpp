// Tests the transfer of bodies between the touch stage and the stage of untouched bodies. The transfer must neither
// lose nor create momentum or energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::physics {
namespace {

constexpr double kG = 9.81;
constexpr double kTouchStageStep_s = 1e-3;
constexpr double kEdge_m = 0.04;
constexpr const char* kNoGravity = R"("gravity_m_per_s2": [0, 0, 0])";

std::string vector_json(const Vec3& v) {
  std::ostringstream out;
  out.precision(17);
  out << "[" << v.x() << "," << v.y() << "," << v.z() << "]";
  return out.str();
}

/// Returns a named box as JSON; `fields` contains additional fields.
std::string box(const std::string& name, const Vec3& size_m, const Vec3& p, const std::string& fields = "") {
  return R"({"name": ")" + name + R"(", "shapes": [{"box": {"size_m": )" + vector_json(size_m) +
         R"(}}], "placement": {"position_m": )" + vector_json(p) + "}" + fields + "}";
}
std::string cube(double mass_kg, const Vec3& p, double friction = 0.5) {
  return box(
      "cube", Vec3::Constant(kEdge_m), p,
      R"(, "graspable": true, "mass_kg": )" + std::to_string(mass_kg) + R"(, "friction": )" + std::to_string(friction));
}
std::string table(double friction = 0.5) {
  return box("table", {1, 1, 0.1}, {0, 0, -0.05}, R"(, "friction": )" + std::to_string(friction));
}
std::string tool_at(const Vec3& p, double friction = 0.5, const std::string& more = "") {
  return R"({"name": "at )" + std::to_string(p.x()) + R"(", "placement": {"position_m": )" + vector_json(p) +
         R"(}, "friction": )" + std::to_string(friction) + more + "}";
}
RigidState at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, Twist{v, Vec3::Zero()}};
}

void run(World& world, int steps) {
  for (int i = 0; i < steps; ++i) world.step();
}

constexpr double kToolMass_kg = 0.05;

TEST(TouchSeam, MomentumOfToolAndPushedBodyChangesByTheHandsPullAlone) {
  const double mass_kg = 0.3;
  World world(server::make_server_world(
      load_parts({.bodies = cube(mass_kg, {0, 0, 0}), .tools = tool_at({-0.03, 0.006, 0.004}), .rest = kNoGravity})));
  world.activate_tool(0);
  Vec3 given = Vec3::Zero();
  const int steps = 400;
  std::uint32_t contacts = 0;
  for (int i = 0; i < steps; ++i) {
    world.set_handle(0, at({-0.03 + 0.1 * i * kTouchStageStep_s, 0.006, 0.004}));
    world.step();
    given -= kTouchStageStep_s * world.tool(0).wrench_on_hand_W.f;
    contacts += world.touch(0).contacts;
  }
  EXPECT_GT(contacts, 0U);
  EXPECT_GT(world.body(BodyId{1}).V.v.x(), 0.05);
  const Vec3 momentum = kToolMass_kg * world.tool(0).tool.V.v + mass_kg * world.body(BodyId{1}).V.v;
  // Tolerance: the residual velocity that the solver may leave in each step (see ContactIsland).
  const double left_m_per_s = 1e-11;
  EXPECT_LT((momentum - given).norm(), steps * left_m_per_s * (kToolMass_kg + mass_kg));
}

/// Returns the distance by which a cube of 0.5 kg on a table moves in one second. A tool pushes the cube sideways with
/// the fraction `share` of the friction limit μ m g.
double pushed_m(double share) {
  const double mass_kg = 0.5;
  const double push_n = share * 0.5 * mass_kg * kG;
  // The tool touches the cube near the table, so that the cube does not tip. The tool has no friction, which would
  // press the cube down.
  const Vec3 start(-0.0251, 0, 0.008);
  World world(server::make_server_world(
      load_parts({.bodies = table() + "," + cube(mass_kg, {0, 0, kEdge_m / 2}), .tools = tool_at(start, 0)})));
  world.activate_tool(0);
  run(world, 50);
  const double before = world.body(BodyId{2}).X.p.x();
  for (int i = 0; i < 1000; ++i) {
    // The handle stays ahead of the tool by a constant distance, so the pushing force is constant.
    const Vec3 p = world.tool(0).tool.X.p;
    world.set_handle(0, at({p.x() + std::min(1.0, i / 200.0) * push_n / 300, start.y(), start.z()},
                           world.tool(0).tool.V.v.x() * Vec3::UnitX()));
    world.step();
  }
  return world.body(BodyId{2}).X.p.x() - before;
}

TEST(TouchSeam, APushedBodyMovesOnlyBeyondFrictionTimesWeight) {
  EXPECT_LT(pushed_m(0.9), 1e-4);
  EXPECT_GT(pushed_m(1.1), 0.05);
}

struct Squeeze {
  double slipped_m = 0;  ///< distance that the cube slips down while the tools rest
  double lifted_m = 0;
  double force_n = 0;  ///< force of one hand towards the cube
};

/// Two tools squeeze a cube of 0.3 kg with 3.6 N each (12 mm of stretch at 300 N/m), lift it by 10 cm and hold it for 2
/// s.
Squeeze squeeze(double friction) {
  const double height_m = kEdge_m / 2;
  const double off_m = kEdge_m / 2 + 0.005;
  World world(server::make_server_world(load_parts({.bodies = table() + "," + cube(0.3, {0, 0, height_m}, friction),
                                                    .tools = tool_at({-off_m - 0.001, 0, height_m}, friction) + "," +
                                                             tool_at({off_m + 0.001, 0, height_m}, friction)})));
  const double in_m = 3.6 / 300;
  const auto hold_at = [&](double squeeze, double z, double v) {
    for (const double side : {-1.0, 1.0}) {
      world.set_handle(side < 0 ? 0 : 1, at({side * (off_m - squeeze * in_m), 0, z}, {0, 0, v}));
    }
  };
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  for (int i = 0; i < 300; ++i) {
    hold_at(std::min(1.0, i / 200.0), height_m, 0);
    world.step();
  }
  for (int i = 1; i <= 1000; ++i) {
    hold_at(1, height_m + 0.1 * i / 1000, 0.1);
    world.step();
  }
  Squeeze result;
  hold_at(1, height_m + 0.1, 0);
  run(world, 300);
  const double before = world.body(BodyId{2}).X.p.z();
  result.lifted_m = before - height_m;
  result.force_n = -world.tool(0).wrench_on_hand_W.f.x();
  run(world, 2000);
  result.slipped_m = before - world.body(BodyId{2}).X.p.z();
  return result;
}

TEST(TouchSeam, TwoToolsCarryABodyByFrictionAlone) {
  const Squeeze held = squeeze(0.8);
  EXPECT_NEAR(held.force_n, 3.6, 0.1);
  // Each coupling carries half of the weight and is stretched accordingly.
  const double sag_m = 0.3 * kG / 2 / 300;
  EXPECT_NEAR(held.lifted_m, 0.1 - sag_m, 2e-3);
  EXPECT_LT(std::abs(held.slipped_m), 5e-4);
}

TEST(TouchSeam, ABodyTooSlipperyForItsWeightIsNotLifted) {
  // The tools can hold at most 2 · 0.3 · 3.6 N = 2.2 N by friction: two contacts, the friction coefficient 0.3, and 3.6
  // N each. The cube's weight is 0.3 kg · g = 2.9 N.
  EXPECT_LT(squeeze(0.3).lifted_m, 0.03);
}

/// A tool presses down a cube that is on the table. The cube must come to rest, and the tool must stay outside.
void expect_calm_under(double mass_kg, double press_n) {
  const Vec3 start(0.004, 0.003, kEdge_m + 0.006);
  World world(server::make_server_world(
      load_parts({.bodies = table() + "," + cube(mass_kg, {0, 0, kEdge_m / 2}), .tools = tool_at(start)})));
  world.activate_tool(0);
  const double press_m = 0.001 + press_n / 300;
  for (int i = 0; i < 500; ++i) {
    world.set_handle(0, at(start - std::min(1.0, i / 400.0) * press_m * Vec3::UnitZ()));
    world.step();
  }
  run(world, 500);
  double fastest = 0;
  double lowest = 1;
  double highest = 0;
  for (int i = 0; i < 500; ++i) {
    world.step();
    fastest = std::max({fastest, world.body(BodyId{2}).V.v.norm(), world.tool(0).tool.V.v.norm()});
    lowest = std::min(lowest, world.body(BodyId{2}).X.p.z());
    highest = std::max(highest, world.body(BodyId{2}).X.p.z());
  }
  EXPECT_LT(fastest, 1e-4) << mass_kg;
  EXPECT_LT(highest - lowest, 1e-6) << mass_kg;
  EXPECT_GT(lowest, kEdge_m / 2 - 5e-4) << mass_kg;
  EXPECT_GT(world.tool(0).tool.X.p.z(), kEdge_m + 0.005 - 7e-4) << mass_kg;
  EXPECT_NEAR(world.touch(0).force_n, press_n, 0.05 * press_n + 0.2) << mass_kg;
}

TEST(TouchSeam, ABodyPressedOnTheTableIsCalmHoweverLight) {
  for (const double mass_kg : {0.1, 0.01, 0.002}) expect_calm_under(mass_kg, 6);
}

TEST(TouchSeam, NoLightPlateOnATableLetsTheToolThrough) {
  for (const double thickness_m : {0.001, 0.006}) {
    for (const double mass_kg : {0.002, 0.01, 0.1}) {
      const std::string plate = box("plate", {0.05, 0.05, thickness_m}, {0, 0, thickness_m / 2},
                                    R"(, "mass_kg": )" + std::to_string(mass_kg));
      const Vec3 start(0.004, 0.003, thickness_m + 0.006);
      World world(server::make_server_world(
          load_parts({.bodies = table() + "," + plate,
                      .tools = tool_at(start),
                      .coupling = R"({"law": "spring-damper", "stiffness_n_per_m": 1000, "force_limit_n": 10})"})));
      world.activate_tool(0);
      for (int i = 0; i < 1500; ++i) {
        world.set_handle(0, at(start - std::min(1.0, i / 500.0) * 0.02 * Vec3::UnitZ()));
        world.step();
        ASSERT_GT(world.tool(0).tool.X.p.z(), thickness_m + 0.005 - 1.2e-3) << mass_kg << " kg, step " << i;
      }
      EXPECT_NEAR(world.touch(0).force_n, 10, 0.01) << mass_kg << " kg, " << thickness_m << " m";
      EXPECT_NEAR(world.body(BodyId{2}).X.p.z(), thickness_m / 2, 5e-4);
    }
  }
}

TEST(TouchSeam, ATouchedBodyLeftAloneRests) {
  const Vec3 start(-0.06, 0, 0.02);
  World world(server::make_server_world(
      load_parts({.bodies = table() + "," + cube(0.1, {0, 0, kEdge_m / 2}), .tools = tool_at(start)})));
  world.activate_tool(0);
  for (int i = 0; i < 1500; ++i) {
    // The handle pushes the cube by up to two centimetres and then withdraws.
    const double way = i < 750 ? 1e-4 * i : 1e-4 * (1500 - i);
    world.set_handle(0, at(start + Vec3(way, 0, 0)));
    world.step();
  }
  const double pushed_to = world.body(BodyId{2}).X.p.x();
  EXPECT_GT(pushed_to, 0.005);
  run(world, 1000);
  EXPECT_NEAR(world.body(BodyId{2}).X.p.x(), pushed_to, 1e-4);
  EXPECT_NEAR(world.body(BodyId{2}).X.p.z(), kEdge_m / 2, 1e-4);
  EXPECT_LT(world.body(BodyId{2}).V.v.norm(), 1e-4);
}

TEST(TouchStage, AmongTooManyPairsThePressingOnesAreKept) {
  // Only one pair of shapes is allowed in this scene. A pebble near the tool precedes the table, but does not touch the
  // tool. The pressing pair of tool and table must be kept.
  const std::string pebble = R"({"name": "pebble", "shapes": [{"sphere": {"radius_m": 0.002}}],
                                 "placement": {"position_m": [0.0065, 0, 0.009]}})";
  const Vec3 start(0, 0, 0.006);
  World world(server::make_server_world(load_parts(
      {.bodies = table() + "," + pebble, .tools = tool_at(start), .rest = R"("limits": {"contact_pairs": 1})"})));
  world.activate_tool(0);
  TickFaults faults = 0;
  for (int i = 0; i < 1000; ++i) {
    world.set_handle(0, at(start - std::min(1.0, i / 400.0) * 0.011 * Vec3::UnitZ()));
    faults |= world.step();
  }
  EXPECT_NE(faults & kFaultContactCoarse, 0U) << "the pebble was near";
  EXPECT_NEAR(world.touch(0).force_n, 3.0, 0.1);
  EXPECT_GT(world.tool(0).tool.X.p.z(), 0.0045);
}

TEST(TouchStage, AContactSticksOnWhileOthersEndAndBegin) {
  const Vec3 first(-0.1, 0, 0.006), second(0.1, 0, 0.006);
  World world(
      server::make_server_world(load_parts({.bodies = table(), .tools = tool_at(first) + "," + tool_at(second)})));
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  // The second tool presses and is pulled sideways within the friction limit. Meanwhile the first tool touches, leaves
  // and touches again. The second tool must not lose its friction state.
  const auto hold = [&](double first_down_m) {
    world.set_handle(0, at(first - first_down_m * Vec3::UnitZ()));
    world.set_handle(1, at(second + Vec3(0.002, 0, -0.011)));
    run(world, 500);
  };
  hold(0.011);
  ASSERT_GT(world.touch(0).contacts, 0U);
  const Vec3 stuck = world.tool(1).tool.X.p;
  ASSERT_LT(stuck.x() - second.x(), 1e-3);
  hold(-0.02);
  ASSERT_EQ(world.touch(0).contacts, 0U);
  EXPECT_LT((world.tool(1).tool.X.p - stuck).norm(), 1e-8);
  hold(0.011);
  ASSERT_GT(world.touch(0).contacts, 0U);
  EXPECT_LT((world.tool(1).tool.X.p - stuck).norm(), 1e-8);
}

TEST(TouchStage, AForceLimitThatIsRaisedLaterDoesNotCarryTheToolThroughAWall) {
  const std::string wall = box("wall", {0.2, 0.2, 0.002}, {0, 0, 0});
  World world(server::make_server_world(
      load_parts({.bodies = wall, .tools = tool_at({0, 0, 0.02}, 0.5, R"(, "mass_kg": 0.005)")})));
  world.activate_tool(0);
  haptics::CouplingParameters strong;
  strong.stiffness_n_per_m = 1e5;
  strong.force_limit_n = 1000;
  world.set_coupling(strong);
  for (int i = 0; i < 200; ++i) {
    world.set_handle(0, at({0, 0, -0.05}));
    world.step();
    ASSERT_GT(world.tool(0).tool.X.p.z(), 0.005) << i;
  }
}

TEST(TouchSeam, AHeldBodyPressesOnAFreeOneAndBothRest) {
  // The lower cube lies freely on the table. A tool holds the upper cube and presses it down with 3 N.
  const std::string upper = box("upper", Vec3::Constant(kEdge_m), {0.003, 0, 1.5 * kEdge_m + 0.002},
                                R"(, "graspable": true, "mass_kg": 0.1)");
  World world(server::make_server_world(
      load_parts({.bodies = table() + "," + cube(0.3, {0, 0, kEdge_m / 2}) + "," + upper,
                  .tools = tool_at({0.003, 0, 1.5 * kEdge_m + 0.002}, 0.5, R"(, "holds": "upper")")})));
  world.activate_tool(0);
  for (int i = 0; i < 500; ++i) {
    world.set_handle(0, at({0.003, 0, 1.5 * kEdge_m + 0.002 - std::min(1.0, i / 400.0) * 0.012}));
    world.step();
  }
  run(world, 1000);
  double fastest = 0;
  for (int i = 0; i < 300; ++i) {
    world.step();
    fastest = std::max({fastest, world.body(BodyId{2}).V.v.norm(), world.body(BodyId{3}).V.v.norm()});
  }
  EXPECT_LT(fastest, 1e-3);
  const double gap_m = world.body(BodyId{3}).X.p.z() - world.body(BodyId{2}).X.p.z() - kEdge_m;
  EXPECT_LT(std::abs(gap_m), 5e-4);
  EXPECT_NEAR(world.touch(0).force_n, world.tool(0).wrench_on_hand_W.f.z() + 0.1 * kG, 0.05);
}

TEST(TouchStage, AToolThatIsPulledBeyondTheSpeedLimitIsSlowedBeforeItMovesNotAfter) {
  // In one step, a tool of 5 g is pulled with 1000 N from 2 cm in front of a wall to 3 cm behind it.
  const std::string wall = box("wall", {0.2, 0.2, 0.002}, {0, 0, 0});
  const std::string coupling = R"({"law": "spring-damper", "stiffness_n_per_m": 100000, "force_limit_n": 1000})";
  World world(server::make_server_world(load_parts(
      {.bodies = wall, .tools = tool_at({0, 0, 0.026}, 0.5, R"(, "mass_kg": 0.005)"), .coupling = coupling})));
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, 0.026}));
  run(world, 10);
  world.set_handle(0, at({0, 0, -0.024}));
  TickFaults faults = 0;
  for (int i = 0; i < 200; ++i) {
    const double before = world.tool(0).tool.X.p.z();
    faults |= world.step();
    ASSERT_LE(before - world.tool(0).tool.X.p.z(), 10 * kTouchStageStep_s * (1 + 1e-9));
    ASSERT_GT(world.tool(0).tool.X.p.z(), 0.005);
  }
  EXPECT_TRUE(faults & kFaultSpeedLimited);
  EXPECT_LT(world.tool(0).tool.X.p.z(), 0.0061);
}

TEST(TouchStage, AllocatesNeitherAtFirstContactNorLater) {
  const std::string soft = R"(, "contact_stiffness_n_per_m3": 1e8)";
  World world(server::make_server_world(
      load_parts({.bodies = box("table", {1, 1, 0.1}, {0, 0, -0.05}, soft), .tools = tool_at({0, 0, 0.02})})));
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, 0.02}));
  run(world, 5);
  std::uint32_t contacts = 0;
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 600; ++i) {
    world.set_handle(0, at({0.001 * i * kTouchStageStep_s, 0, std::max(0.0, 0.02 - 0.1 * i * kTouchStageStep_s)}));
    world.step();
    contacts += world.touch(0).contacts;
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_GT(contacts, 300U);
}

}  // namespace
}  // namespace tandem::physics
