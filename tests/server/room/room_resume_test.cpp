// Tests a room that resumes from the state of another room: bodies keep their poses, and a returning user gets the
// former tool with its held body. Tests commands that place bodies, too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/recording/room_checkpoint.hpp"
#include "server/room/room.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

constexpr const char* kTwoCubes =
    R"({"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}},
       {"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
        "placement": {"position_m": [0, 0, 0.02]}},
       {"name": "b", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2,
        "placement": {"position_m": [0.2, 0, 0.02]}})";
constexpr const char* kRoomResumeTwoTools =
    R"({"name": "l", "placement": {"position_m": [0, 0, 0.05]}}, {"name": "r", "placement": {"position_m": [0.5, 0, 0.3]}})";

constexpr const char* kTwoPads =
    R"("soft_bodies": [
       {"name": "glued", "block": {"size_m": [0.08, 0.08, 0.04], "spacing_m": 0.02}, "mass_kg": 0.3, "anchored": ["-z"],
        "placement": {"position_m": [0.3, 0.3, 0.02]}},
       {"name": "loose", "block": {"size_m": [0.08, 0.08, 0.04], "spacing_m": 0.02}, "mass_kg": 0.3,
        "placement": {"position_m": [-0.3, 0.3, 0.8]}}])";

/// Limit of the motion of a body that a tool holds after the resume. In the first step, T = 1 ms, the tool does not
/// hold the body yet, which falls by g T². The limit is 1 % larger.
constexpr double kFallOfAStep_m = 1.01 * 9.81e-6;

class RoomResumeTest : public ::testing::Test {
 protected:
  RoomResumeTest()
      : room_(RoomId{1}, "test", physics::load_parts({.bodies = kTwoCubes, .tools = kRoomResumeTwoTools})) {}

  void join(std::uint8_t seat, std::uint32_t user, std::uint8_t tool) {
    ASSERT_TRUE(room_.post({.seat = {seat, UserId{user}, UserRole::kManipulator, tool}}));
  }
  void send(std::uint8_t seat, const Vec3& p) {
    proto::ClientUpdate update;
    update.input_tick = Tick{++ticks_};
    update.handle.X.p = p;
    update.handle_valid = true;
    room_.input(seat).publish(update);
  }
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) room_.step(ServerTime(room_.period() * static_cast<Duration::rep>(++steps_)));
  }

  Room room_;
  std::uint64_t ticks_ = 0;
  std::uint64_t steps_ = 0;
};

TEST_F(RoomResumeTest, GoesOnFromTheStateOfAnother) {
  join(0, 7, 0);
  join(1, 8, 1);
  send(0, {0, 0, 0.05});
  step();
  ASSERT_TRUE(room_.post({.kind = RoomCommand::Kind::kGrab, .seat = {0, UserId{7}}, .body = BodyId{2}, .request = 1}));
  for (int i = 0; i < 400; ++i) {
    send(0, {0, 1e-4 * i, 0.05 + 2e-4 * i});
    send(1, {0.5, 0, 0.3});
    step();
  }
  ASSERT_EQ(room_.world().tool(0).held, BodyId{2});
  RoomState state;
  room_.describe(state);
  Room next(RoomId{1}, "test", room_.shared_scene());
  next.resume(state);
  EXPECT_FALSE(next.is_idle()) << "an empty room that differs from its scene must not be idle";
  EXPECT_LT((next.world().body(BodyId{2}).X.p - room_.world().body(BodyId{2}).X.p).norm(), 1e-12);
  const Vec3 hung = next.world().body(BodyId{2}).X.p;
  for (int i = 1; i <= 1000; ++i) next.step(ServerTime(next.period() * i));
  EXPECT_LT((next.world().body(BodyId{2}).X.p - hung).norm(), kFallOfAStep_m) << "it hangs where it was held";
  // Tool 0 held the body. The user of tool 1 returns first and must not get the body.
  ASSERT_TRUE(next.post({.seat = {0, UserId{1}, UserRole::kManipulator, 1}}));
  ASSERT_TRUE(next.post({.seat = {1, UserId{2}, UserRole::kManipulator, 0}}));
  next.step(ServerTime(next.period() * 1001));
  EXPECT_EQ(next.world().tool(0).held, BodyId{2});
  EXPECT_FALSE(next.world().tool(1).held.is_valid());
  EXPECT_LT((next.world().tool(1).tool.X.p - room_.world().tool(1).tool.X.p).norm(), 1e-3);
  EXPECT_LT((next.world().tool(0).tool.X.p - room_.world().tool(0).tool.X.p).norm(), 1e-3);
}

TEST(RoomCheckpoint, IsOfTheSameSceneHoweverThatIsDrawn) {
  const auto scene = physics::load_parts({.bodies = kTwoCubes, .tools = kRoomResumeTwoTools});
  const wire::RoomCheckpoint kept = checkpoint_of(Room(RoomId{1}, "test", scene));
  LoadedScene other = *scene;
  other.assets.emplace_back().kind = "drawing";
  EXPECT_TRUE(state_of(kept, other));
  other.assets.emplace_back().kind = "contact";
  EXPECT_FALSE(state_of(kept, other)) << "touch is another";
}

TEST_F(RoomResumeTest, SoftBodiesGoOnWhereTheyWere) {
  const auto scene = physics::load_parts({.bodies = kTwoCubes, .tools = kRoomResumeTwoTools, .rest = kTwoPads});
  Room room(RoomId{1}, "test", scene), next(RoomId{1}, "test", scene);
  RoomState at_start;
  room.describe(at_start);
  EXPECT_TRUE(at_start.soft_nodes_W.empty());
  ASSERT_TRUE(room.post({.seat = {0, UserId{7}, UserRole::kManipulator, 0}}));
  for (int i = 1; i <= 300; ++i) room.step(ServerTime(room.period() * i));
  const wire::RoomCheckpoint kept = checkpoint_of(room);
  const auto state = state_of(kept, *scene);
  ASSERT_TRUE(state);
  wire::RoomCheckpoint torn = kept;
  torn.mutable_soft_nodes()->RemoveLast();
  EXPECT_FALSE(state_of(torn, *scene));
  next.resume(*state);
  EXPECT_FALSE(next.is_idle());
  for (std::size_t pad = 0; pad < 2; ++pad) {
    EXPECT_TRUE(std::ranges::equal(next.world().soft_nodes_W(pad), room.world().soft_nodes_W(pad))) << pad;
    EXPECT_FALSE(std::ranges::equal(next.world().soft_nodes_W(pad), scene->soft_bodies[pad].nodes_W)) << pad;
  }
  // The soft bodies must continue from the restored state. The body `loose` has fallen for 0.3 s and must continue to
  // fall to the floor.
  const auto lowest_m = [](const Room& of) {
    double lowest = 1;
    for (const Vec3& node_W : of.world().soft_nodes_W(1)) lowest = std::min(lowest, node_W.z());
    return lowest;
  };
  const double left_m = lowest_m(next);
  EXPECT_LT(left_m, 0.75);
  for (int i = 1; i <= 1500; ++i) next.step(ServerTime(next.period() * i));
  EXPECT_LT(lowest_m(next), left_m - 0.3);
  EXPECT_GT(lowest_m(next), -0.02);
}

TEST_F(RoomResumeTest, AHeldBodyFallsIfItsUserDoesNotReturn) {
  RoomState state;
  state.bodies.push_back({BodyId{2}, {{Vec3(0, 0, 0.3), Quat::Identity()}, {}}, UserId{}});
  state.tools.push_back(
      {0, {{Vec3(0, 0, 0.33), Quat::Identity()}, {}}, BodyId{2}, {Vec3(0, 0, 0.03), Quat::Identity()}});
  room_.resume(state);
  const auto steps_in = [this](Duration time) { return static_cast<int>(time / room_.period()); };
  step(steps_in(kKeptFor) - 10);
  EXPECT_NEAR(room_.world().body(BodyId{2}).X.p.z(), 0.3, kFallOfAStep_m);
  step(2000);
  EXPECT_NEAR(room_.world().body(BodyId{2}).X.p.z(), 0.02, 1e-3);
  step(steps_in(std::chrono::seconds(30)));
  EXPECT_TRUE(room_.is_idle()) << "and after a while all is as the scene says";
  EXPECT_LT((room_.world().body(BodyId{2}).X.p - Vec3(0, 0, 0.02)).norm(), 1e-6);
}

TEST_F(RoomResumeTest, IgnoresValuesOfAStateThatAreOutOfRange) {
  RoomState state;
  const double nan = std::nan("");
  state.bodies.push_back({BodyId{2}, {{Vec3(nan, 0, 0), Quat::Identity()}, {}}, UserId{}});
  state.bodies.push_back({BodyId{1}, {{Vec3(0, 0, 5), Quat::Identity()}, {}}, UserId{}});  // the floor
  state.bodies.push_back({BodyId{99}, {}, UserId{}});
  state.bodies.push_back({BodyId{3}, {{Vec3(0, 0, 1e9), Quat::Identity()}, {}}, UserId{}});
  state.tools.push_back({15, {}, BodyId{2}, {}});
  state.tools.push_back({0, {{Vec3(0, 0, nan), Quat::Identity()}, {}}, BodyId{2}, {}});
  room_.resume(state);
  EXPECT_TRUE(room_.is_idle()) << "all is as the scene says";
}

TEST_F(RoomResumeTest, PlacingAHeldBodyElsewhereMakesNoForce) {
  join(0, 7, 0);
  send(0, {0, 0, 0.05});
  step();
  ASSERT_TRUE(room_.post({.kind = RoomCommand::Kind::kGrab, .seat = {0, UserId{7}}, .body = BodyId{2}, .request = 1}));
  for (int i = 0; i < 200; ++i) {
    send(0, {0, 0, 0.05 + 2e-4 * i});
    step();
  }
  const physics::ToolState before = room_.world().tool(0);
  ASSERT_EQ(before.held, BodyId{2});
  RoomCommand place;
  place.kind = RoomCommand::Kind::kPlace;
  place.seat = {0, UserId{7}};
  place.body = BodyId{2};
  place.beside = BodyId{3};
  const Pose X_WB{before.tool.X.p + Vec3(0.002, 0, -0.005), quaternion_of({0, 0, 1})};
  place.X_SB = room_.world().body(BodyId{3}).X.inverse() * X_WB;
  ASSERT_TRUE(room_.post(place));
  send(0, {0, 0, 0.09});
  step();
  EXPECT_LT((room_.world().body(BodyId{2}).X.p - X_WB.p).norm(), 1e-4);
  EXPECT_LT(room_.world().body(BodyId{2}).X.q.angularDistance(X_WB.q), 1e-3);
  const physics::ToolState after = room_.world().tool(0);
  EXPECT_EQ(after.held, BodyId{2});
  EXPECT_LT((after.tool.X.p - before.tool.X.p).norm(), 3e-4) << "no more than it moved anyway";
  EXPECT_LT((after.wrench_on_hand_W.f - before.wrench_on_hand_W.f).norm(), 0.1);
}

TEST_F(RoomResumeTest, ABodyIsPlacedNowhereThatItCannotBe) {
  join(0, 7, 0);
  step();
  const Pose before = room_.world().body(BodyId{2}).X;
  RoomCommand place;
  place.kind = RoomCommand::Kind::kPlace;
  place.seat = {0, UserId{7}};
  place.beside = BodyId{3};
  for (const Vec3& p : {Vec3(std::nan(""), 0, 0), Vec3(1e9, 0, 0)}) {
    place.body = BodyId{2};
    place.X_SB.p = p;
    ASSERT_TRUE(room_.post(place));
  }
  place.body = BodyId{1};  // the floor
  place.X_SB.p = Vec3(0, 0, 1);
  ASSERT_TRUE(room_.post(place));
  step();
  EXPECT_LT((room_.world().body(BodyId{2}).X.p - before.p).norm(), 1e-4);
  EXPECT_LT(room_.world().body(BodyId{1}).X.p.z(), 0);
}

}  // namespace
}  // namespace tandem::server
