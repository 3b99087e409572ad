// Who shares a body, and over how long a loop: what the joints of all who do are made from.
#include "server/room/body_sharing.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/common/physics/world_support.hpp"

namespace tandem::server {
namespace {

constexpr BodyId kBody{1};
constexpr Duration kShort = std::chrono::milliseconds(40);
constexpr Duration kLong = std::chrono::milliseconds(120);

/// A cube and two tools far from it.
class BodySharingTest : public ::testing::Test {
 protected:
  BodySharingTest() : world_(physics::client_world(scene())), sharing_(world_, std::array{kBody}, 2) {
    for (const std::size_t tool : {0U, 1U}) world_.activate_tool(tool);
    sharing_.set_loop(0, kShort);
    sharing_.set_loop(1, kLong);
  }
  static physics::WorldDescription scene() {
    return physics::world_of({physics::cube(Vec3::Zero(), 0.3)},
                             {physics::ball_tool({0, 0, 1}), physics::ball_tool({0, 0, 2})});
  }
  void step() {
    world_.step();
    sharing_.update();
  }

  physics::World world_;
  BodySharing sharing_;
};

TEST_F(BodySharingTest, WhatOneAloneHoldsIsNotShared) {
  world_.hold(0, kBody, Pose{});
  step();
  EXPECT_EQ(sharing_.hand_count(0), 1U);
  EXPECT_EQ(sharing_.slowest_loop(0), Duration{0});
  EXPECT_EQ(sharing_.slowest_loop(1), Duration{0});
  EXPECT_EQ(sharing_.other_holders(kBody, 0), 0U);
  EXPECT_EQ(sharing_.other_holders(kBody, 1), 1U);
}

TEST_F(BodySharingTest, AllWhoShareABodyHaveTheLongestLoopOfThem) {
  for (const std::size_t tool : {0U, 1U}) world_.hold(tool, kBody, Pose{});
  step();
  EXPECT_EQ(sharing_.hand_count(0), 2U);
  for (const std::size_t tool : {0U, 1U}) {
    EXPECT_EQ(sharing_.slowest_loop(tool), kLong);
    EXPECT_EQ(sharing_.other_holders(kBody, tool), 1U);
  }
  sharing_.set_loop(1, Duration{0});
  EXPECT_EQ(sharing_.slowest_loop(0), kShort) << "the other's client has no copies";
  world_.release(1);
  step();
  EXPECT_EQ(sharing_.slowest_loop(0), Duration{0});
}

}  // namespace
}  // namespace tandem::server
