// Tests how the room compensates a user's delay: played inputs, their states for other users, and waves.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/haptics/wave/wave_port.hpp"
#include "server/room/room_seats.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::server {
namespace {

constexpr const char* kFloatingBox =
    R"({"name": "box", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
        "gravity": false})";
constexpr const char* kTwoTools =
    R"({"name": "l", "placement": {"position_m": [-0.03, 0, 0]}},
        {"name": "r", "placement": {"position_m": [0.03, 0, 0]}})";

class RoomBridge : public ::testing::Test {
 protected:
  RoomBridge() : scene_(physics::load_parts({.bodies = kFloatingBox, .tools = kTwoTools})) {}

  struct Bench {
    explicit Bench(std::shared_ptr<const LoadedScene> scene) : room(RoomId{1}, "test", std::move(scene)) {}

    void join(std::uint8_t place) {
      ASSERT_TRUE(room.post({.seat = {place, UserId{place + 1U}, UserRole::kManipulator, place}}));
    }
    proto::ServerUpdate step(std::uint8_t seat = 0) {
      room.step(ServerTime(room.period() * static_cast<Duration::rep>(room.steps_done().value + 1)));
      room.output().poll();
      return room.output().front().for_seat(seat);
    }

    Room room;
  };

  static proto::ClientUpdate input(std::uint64_t tick, const Vec3& p, proto::ClientMode mode,
                                   std::uint32_t buttons = 0) {
    proto::ClientUpdate update;
    update.input_tick = Tick{tick};
    update.sent = LocalTime(std::chrono::milliseconds(tick));
    update.handle.X.p = p;
    update.handle_valid = true;
    update.mode = mode;
    update.buttons = buttons;
    update.round_trip = std::chrono::milliseconds(60);
    return update;
  }
  /// Returns a position on a circle away from the box, with 0.1 s per turn.
  static Vec3 stirring(std::uint64_t tick) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(tick) / 100;
    return {-0.08 + 0.01 * std::sin(angle), 0.01 * std::cos(angle), 0};
  }

  std::shared_ptr<const LoadedScene> scene_;
};

TEST_F(RoomBridge, APlayedHandleMovesTheToolAsTheSameHandleGivenDirectlyDoes) {
  Bench played(scene_), given(scene_);
  played.join(0);
  given.join(0);
  std::uint64_t compared = 0;
  for (std::uint64_t step = 1; step <= 2000; ++step) {
    played.room.input(0).publish(input(step, stirring(step), proto::ClientMode::kLocalModel));
    const proto::ServerUpdate received = played.step();
    // Room `given` receives, without playout, the inputs that the playout of room `played` has chosen. It runs one step
    // behind, because the chosen tick is known only after the step of `played`.
    if (received.answered_input.value != 0) {
      given.room.input(0).publish(input(step, stirring(received.answered_input.value), proto::ClientMode::kHandle));
    }
    const proto::ServerUpdate same = given.step();
    ASSERT_EQ(received.tool.X.p, same.tool.X.p) << "step " << step;
    ASSERT_EQ(received.wrench_on_hand_W.f, same.wrench_on_hand_W.f);
    compared += received.answered_input.value != step;
  }
  EXPECT_GT(compared, 500U) << "nothing was played late, so nothing was tested";
}

TEST_F(RoomBridge, OthersAreToldTheHandleInUseAndWhatTheHandWasShownThere) {
  Bench bench(scene_);
  bench.join(0);
  bench.join(1);
  std::uint64_t compared = 0;
  for (std::uint64_t tick = 1; tick <= 500; ++tick) {
    proto::ClientUpdate update = input(tick, stirring(tick), proto::ClientMode::kLocalModel);
    update.on_hand_W.f.x() = static_cast<double>(tick);
    bench.room.input(0).publish(update);
    const proto::ServerUpdate received = bench.step(1);
    const Tick answered = bench.room.answered(0);
    if (answered.value == 0) continue;
    ASSERT_EQ(received.users.size(), 1U);
    const proto::OtherUserState& other = received.users[0];
    ASSERT_TRUE(other.has_handle);
    EXPECT_EQ(other.tool_index, 0U);
    EXPECT_LT((other.handle.X.p - stirring(answered.value)).norm(), 1e-12);
    EXPECT_EQ(other.on_hand_W.f.x(), static_cast<double>(answered.value));
    EXPECT_EQ(other.handle_age, std::chrono::milliseconds(30)) << "half of the round trip";
    compared += answered.value != tick ? 1 : 0;
  }
  EXPECT_GT(compared, 100U) << "nothing was played late, so nothing was tested";
}

TEST_F(RoomBridge, OfAClientWithoutAModelOthersAreToldTheServersOwnForce) {
  Bench bench(scene_);
  bench.join(0);
  bench.join(1);
  proto::ServerUpdate received;
  for (std::uint64_t tick = 1; tick <= 500; ++tick) {
    bench.room.input(0).publish(input(tick, {-0.02, 0, 0}, proto::ClientMode::kHandle));
    bench.room.input(1).publish(input(tick, {0.02, 0, 0}, proto::ClientMode::kHandle));
    received = bench.step(1);
  }
  ASSERT_EQ(received.users.size(), 1U);
  const Wrench there = bench.room.world().tool(0).wrench_on_hand_W;
  EXPECT_LT(there.f.x(), -0.1) << "both press on the box";
  EXPECT_NEAR(received.users[0].on_hand_W.f.x(), there.f.x(), 1e-3);
}

TEST_F(RoomBridge, AGraspIsOfTheInputThatPressed) {
  Bench bench(scene_);
  bench.join(0);
  constexpr std::uint64_t kPressed = 404;
  proto::ServerUpdate before, received;
  for (std::uint64_t step = 1; step <= 500 && !received.held_body.is_valid(); ++step) {
    // Publishes every tenth input, as if later inputs had overwritten the others in the mailbox. Because of such gaps,
    // the playout must delay the inputs.
    if (step % 10 == 0) {
      bench.room.input(0).publish(input(step, {-0.03, 0, 0}, proto::ClientMode::kLocalModel,
                                        step >= kPressed ? std::uint32_t{kButtonGrab} : 0U));
    }
    before = received;
    received = bench.step();
  }
  ASSERT_TRUE(received.held_body.is_valid());
  EXPECT_GT(received.playout, std::chrono::milliseconds(4)) << "played at once, so nothing was tested";
  // The button was pressed at tick 404. It is up in the received input of tick 400 and down in that of tick 410; the
  // inputs between them are lost. The grasp must happen between these two ticks, not after them.
  EXPECT_GT(received.answered_input, Tick{400});
  EXPECT_LE(before.answered_input, Tick{400});
}

TEST_F(RoomBridge, TheGraspIsToldAsThePlaceOfTheToolOnTheBody) {
  Bench bench(scene_);
  bench.join(0);
  proto::ServerUpdate received;
  for (std::uint64_t tick = 1; tick <= 400; ++tick) {
    const Vec3 p = Vec3(-0.03, 0, 0) + Vec3(0.0001, 0.0002, 0) * static_cast<double>(tick);
    bench.room.input(0).publish(input(tick, p, proto::ClientMode::kHandle, kButtonGrab));
    received = bench.step();
  }
  ASSERT_TRUE(received.held_body.is_valid());
  const Pose& X_WB = received.bodies.at(0).state.X;
  EXPECT_LE(((X_WB * received.X_BT).p - received.tool.X.p).norm(), 1e-12);
  EXPECT_GT(X_WB.p.norm(), 0.01) << "the body has not moved, so nothing was tested";
}

TEST_F(RoomBridge, AnotherModeOrAnotherUserStartsWithNothingOfTheLast) {
  Bench bench(scene_);
  bench.join(0);
  for (std::uint64_t tick = 1; tick <= 200; ++tick) {
    bench.room.input(0).publish(input(tick, stirring(tick), proto::ClientMode::kLocalModel));
    bench.step();
  }
  bench.room.input(0).publish(input(201, stirring(201), proto::ClientMode::kHandle));
  proto::ServerUpdate received = bench.step();
  EXPECT_EQ(received.answered_input, Tick{201}) << "the newest, at once";
  EXPECT_EQ(received.playout, Duration{0});
  bench.join(0);
  received = bench.step();
  EXPECT_EQ(received.answered_input, Tick{0});
}

TEST_F(RoomBridge, WavesMoveTheToolWhereTheHandIsAndAreAnswered) {
  Bench bench(scene_);
  bench.join(0);
  haptics::WaveHandPort hand(haptics::WaveImpedance{}, haptics::WavePlayer::Settings{});
  proto::ServerUpdate received;
  Wrench largest;
  for (std::uint64_t tick = 1; tick <= 3000; ++tick) {
    // During the first second, the hand moves 2 cm away from the box.
    const Pose X_WH{Vec3(-0.03 - 0.02 * std::min(1.0, static_cast<double>(tick) / 1000), 0, 0), Quat::Identity()};
    if (tick > 1) hand.receive(std::chrono::milliseconds(tick - 1), received.wave);
    const Wrench on_hand = hand.tick(X_WH, 1e-3);
    hand.set_displayed(on_hand);
    if (on_hand.f.norm() > largest.f.norm()) largest = on_hand;
    proto::ClientUpdate update = input(tick, X_WH.p, proto::ClientMode::kWave);
    update.wave = hand.sum_towards_tool();
    bench.room.input(0).publish(update);
    received = bench.step();
    ASSERT_TRUE(is_finite(received.wave));
  }
  EXPECT_NEAR(received.tool.X.p.x(), -0.05, 0.003);
  EXPECT_GT(received.wave.f.norm(), 0);
  EXPECT_LT(largest.f.norm(), 5);
}

TEST_F(RoomBridge, NoModeNorAChangeOfItAllocates) {
  Bench bench(scene_);
  bench.join(0);
  std::uint64_t tick = 0;
  const auto run = [&](std::uint64_t count) {
    for (std::uint64_t end = tick + count; tick < end;) {
      ++tick;
      const auto mode = static_cast<proto::ClientMode>(tick / 100 % 3);
      bench.room.input(0).publish(input(tick, stirring(tick), mode));
      bench.step();
    }
  };
  run(600);
  const std::uint64_t before = test::allocation_count();
  run(600);
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

/// Two users: the operator is idle, and the other user presses 8 mm deep and feels the coupling. Fails if a coupling
/// law that the operator has set stays in force after the operator has left.
TEST(RoomLaw, IsTheScenesAgainWhenTheOperatorHasLeft) {
  const auto scene = physics::load_parts({.tools = R"({"name": "l", "placement": {"position_m": [0, 0, 2]}},
                   {"name": "r", "placement": {"position_m": [0, 0, 0.505]}})"});
  Room room(RoomId{1}, "test", scene);
  RoomSeats seats(room);
  const auto anna = seats.allocate(UserRole::kOperator), ben = seats.allocate(UserRole::kManipulator);
  std::uint64_t tick = 0;
  const auto force_after_a_second_n = [&] {
    for (int i = 0; i < 1000; ++i) {
      proto::ClientUpdate update;
      update.input_tick = Tick{++tick};
      update.sent = LocalTime(std::chrono::milliseconds(tick));
      update.handle.X.p = {0, 0, 0.497};
      update.handle_valid = true;
      room.input(ben->index).publish(update);
      room.step(ServerTime(room.period() * static_cast<Duration::rep>(tick)));
    }
    return room.world().tool(ben->tool).wrench_on_hand_W.f.z();
  };
  const double of_scene_n = force_after_a_second_n();
  EXPECT_NEAR(of_scene_n, 2.4, 0.1) << "300 N/m";
  seats.set_law(*anna, *haptics::find_coupling_law("stable-dynamic"));
  EXPECT_EQ(seats.coupling().law, "stable-dynamic");
  EXPECT_NEAR(force_after_a_second_n(), 6.5 * (1 - std::exp(-std::pow(2.4 / 6.5, 2))), 0.1);
  seats.leave(*anna);
  EXPECT_EQ(seats.coupling().law, "spring-damper");
  EXPECT_NEAR(force_after_a_second_n(), of_scene_n, 1e-6);
}

}  // namespace
}  // namespace tandem::server
