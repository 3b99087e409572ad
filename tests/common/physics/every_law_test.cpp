// Tests each coupling law of the catalog in a room: no law may destabilise the room.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

RigidState at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, Twist{v, Vec3::Zero()}};
}

std::string shipped_with_law(const std::string& scene, const std::string& law_name) {
  std::ifstream file(shipped_scene(scene));
  std::ostringstream text;
  text << file.rdbuf();
  std::string json = text.str();
  const std::string old = R"("law": "stable-dynamic")";
  const std::size_t place = json.find(old);
  EXPECT_NE(place, std::string::npos);
  return json.replace(place, old.size(), law_fields(law_name));
}

std::vector<std::string> law_names() {
  std::vector<std::string> names;
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) names.emplace_back(law.name);
  return names;
}

class EveryLaw : public testing::TestWithParam<std::string> {};

TEST_P(EveryLaw, MovesThePegForTwoSecondsWithoutAFault) {
  World world(
      server::make_server_world(server::load_scene_text(shipped_with_law("peg_in_hole", GetParam()), "peg", ".")));
  for (const std::size_t tool : {0U, 1U}) world.activate_tool(tool);
  for (int i = 0; i < 2000; ++i) {
    // The handles move sideways to the hole and down onto the block beside it, with a tremor of 10 Hz.
    const double across = 1e-4 * std::min(i, 1000), down = 1e-4 * std::max(0, i - 1000);
    const Vec3 offset(across, 3e-4 * std::sin(0.0628 * i), -down);
    world.set_handle(0, at(Vec3(-0.04, -0.01, 0.12) + offset));
    world.set_handle(1, at(Vec3(-0.04, 0.01, 0.12) + offset));
    const TickFaults faults = world.step();
    // Two faults are allowed. The coupling may saturate, and a soft or a rigid law may press the peg so deep into the
    // block that the contacts exceed their budget.
    ASSERT_EQ(faults & ~static_cast<TickFaults>(kFaultCouplingSaturated | kFaultContactCoarse), 0U) << "step " << i;
    for (const std::size_t tool : {0U, 1U}) {
      const Wrench wrench = world.tool(tool).wrench_on_hand_W;
      ASSERT_TRUE(is_finite(wrench)) << i;
      ASSERT_LE(wrench.f.norm(), 6.5 + 1e-9) << i;
    }
  }
  EXPECT_GT(world.body(BodyId{3}).X.p.x(), 0.0) << "the peg came along";
}

/// Returns a scene with a tool of the default shape (a ball), 20 mm above a block whose top is z = 0.
std::shared_ptr<const server::LoadedScene> ball_over_block(const std::string& law) {
  const std::string block = R"({"name": "block", "shapes": [{"box": {"size_m": [0.2, 0.2, 0.1]}}],
                                "placement": {"position_m": [0, 0, -0.05]}})";
  return load_parts({.bodies = block,
                     .tools = R"({"name": "ball", "placement": {"position_m": [0, 0, 0.02]}})",
                     .coupling = coupling_with(law)});
}

TEST_P(EveryLaw, PressesABallOnABlockForTwoSecondsWithoutAFault) {
  World world(server::make_server_world(ball_over_block(GetParam())));
  world.activate_tool(0);
  for (int i = 0; i < 2000; ++i) {
    const double x = 0.02 * std::sin(0.003 * i), z = 0.008 + 0.008 * std::cos(0.01 * i);
    world.set_handle(0, at({x, 0, z}, {0.06 * std::cos(0.003 * i), 0, -0.08 * std::sin(0.01 * i)}));
    // Only the rigid law presses the ball into the block up to the ball's centre, which exceeds the contact budget.
    const auto coarse = GetParam() == "direct" ? static_cast<TickFaults>(kFaultContactCoarse) : TickFaults{0};
    ASSERT_EQ(world.step() & ~static_cast<TickFaults>(kFaultCouplingSaturated | coarse), 0U) << "step " << i;
    ASSERT_LE(world.tool(0).wrench_on_hand_W.f.norm(), 6.5 + 1e-9) << i;
  }
}

TEST_P(EveryLaw, IsBrakedToAStandstillAndLetGoAgainWithoutAFault) {
  World world(server::make_server_world(ball_over_block(GetParam())));
  world.activate_tool(0);
  for (int i = 0; i < 1000; ++i) {
    world.brake(0, 2000 * std::clamp(0.5 + std::sin(0.02 * i), 0.0, 1.0));
    const double z = 0.002 + 1e-4 * std::max(0, 180 - i);
    world.set_handle(0, at({0.02 * std::sin(0.003 * i), 0, z}, {0.06 * std::cos(0.003 * i), 0, i < 180 ? -0.1 : 0}));
    // A massless tool may exceed the speed limit for one step when the brake is released.
    ASSERT_EQ(world.step() & ~static_cast<TickFaults>(kFaultCouplingSaturated | kFaultSpeedLimited), 0U)
        << "step " << i;
    ASSERT_TRUE(is_finite(world.tool(0).tool.X)) << i;
    ASSERT_LE(world.tool(0).wrench_on_hand_W.f.norm(), 6.5 + 1e-9) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Catalog, EveryLaw, testing::ValuesIn(law_names()), [](const auto& law) {
  std::string name = law.param;
  std::erase(name, '-');
  return name;
});

}  // namespace
}  // namespace tandem::physics
