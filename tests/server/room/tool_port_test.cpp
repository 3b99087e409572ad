// Tests when a hand is extrapolated while its inputs are missing. A wrong decision drops a shared object or presses too
// hard.
#include "server/room/tool_port.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/haptics/coupling/rendered_coupling.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

/// A cube of 4 cm on a table, with a tool on each side.
class OnTable {
 public:
  OnTable() {
    left.open(0, haptics::kNoCouplingBounds);
    right.open(1, haptics::kNoCouplingBounds);
    move_to(left_at, right_at);
  }

  /// Moves both hands during 0.2 s, then lets them rest for 0.2 s.
  void move_to(const Vec3& left_to, const Vec3& right_to) {
    for (int k = 1; k <= 400; ++k) {
      const double share = std::min(1.0, k / 200.0);
      left.set_handle({{left_at + share * (left_to - left_at), Quat::Identity()}, {}});
      right.set_handle({{right_at + share * (right_to - right_at), Quat::Identity()}, {}});
      world.step();
    }
    left_at = left_to;
    right_at = right_to;
  }

  physics::World world{make_server_world(physics::load_parts(
      {.bodies = R"({"name": "cube", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.3,
                     "graspable": true, "placement": {"position_m": [0, 0, 0.02]}},
                    {"name": "table", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}],
                     "placement": {"position_m": [0, 0, -0.05]}})",
       .tools = R"({"name": "l", "placement": {"position_m": [-0.03, 0, 0.02]}},
                   {"name": "r", "placement": {"position_m": [0.1, 0, 0.02]}})"}))};
  ToolPort left{world, false}, right{world, false};
  Vec3 left_at{-0.03, 0, 0.02}, right_at{0.1, 0, 0.02};
};

TEST(ToolPort, OfTwoThatPressOnOneThingEachRunsOnAndOfOneAloneNot) {
  OnTable on;
  EXPECT_FALSE(on.left.runs_on()) << "in the air";
  on.move_to({-0.02, 0, 0.02}, on.right_at);
  ASSERT_GT(on.world.touch(0).contacts, 0U);
  EXPECT_FALSE(on.left.runs_on());
  on.move_to(on.left_at, {0.04, 0, 0.02});
  on.move_to(on.left_at, {0.02, 0, 0.02});
  EXPECT_TRUE(on.left.runs_on());
  EXPECT_TRUE(on.right.runs_on());
}

TEST(ToolPort, OfWhatIsHeldRunsOnWhatIsCarriedAndNotWhatIsPressedOnATable) {
  OnTable on;
  ASSERT_EQ(on.world.grab(0, BodyId{1}), physics::GrabResult::kGrabbed);
  on.move_to(on.left_at + Vec3(0, 0, 0.05), on.right_at);
  EXPECT_TRUE(on.left.runs_on());
  on.move_to(on.left_at - Vec3(0, 0, 0.055), on.right_at);
  ASSERT_GT(on.world.touch(0).contacts, 0U);
  EXPECT_FALSE(on.left.runs_on()) << "a hand that has stopped would press by as much more";
  // Both hands press on the cube from opposite sides. If one of them stopped, the other would push the cube away, so
  // both must be extrapolated.
  on.move_to(on.left_at + Vec3(0, 0, 0.055), on.right_at + Vec3(0, 0, 0.05));
  on.move_to(on.left_at, on.left_at + Vec3(0.07, 0, 0));
  on.move_to(on.left_at, on.left_at + Vec3(0.05, 0, 0));
  ASSERT_GT(on.world.touch(0).contacts, 0U);
  EXPECT_TRUE(on.left.runs_on());
  EXPECT_TRUE(on.right.runs_on());
}

}  // namespace
}  // namespace tandem::server
