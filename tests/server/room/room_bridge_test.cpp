// How the room bridges a user's delay: inputs played out, a joint to the user's own tool, waves.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/haptics/wave/wave_port.hpp"
#include "common/physics/joints/delayed_joint.hpp"
#include "server/room/room.hpp"
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
    proto::ServerUpdate step(std::uint8_t told = 0) {
      room.step(ServerTime(room.period() * static_cast<Duration::rep>(room.steps_done().value + 1)));
      room.output(told).poll();
      return room.output(told).front().update;
    }

    Room room;
  };

  static proto::ClientUpdate input(std::uint64_t tick, const Vec3& p, proto::ClientMode mode,
                                   std::uint32_t buttons = 0) {
    proto::ClientUpdate update;
    update.input_tick = Tick{tick};
    update.sent = LocalTime(std::chrono::milliseconds(tick));
    update.handle.X.p = update.tool.X.p = p;
    update.handle_valid = true;
    update.mode = mode;
    update.buttons = buttons;
    update.round_trip = std::chrono::milliseconds(60);
    return update;
  }
  /// Away from the box, 0.1 s for a round.
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
    const proto::ServerUpdate told = played.step();
    // The one step ahead: what the played room answers is known only after its step.
    if (told.answered_input.value != 0) {
      given.room.input(0).publish(input(step, stirring(told.answered_input.value), proto::ClientMode::kHandle));
    }
    const proto::ServerUpdate same = given.step();
    ASSERT_EQ(told.tool.X.p, same.tool.X.p) << "step " << step;
    ASSERT_EQ(told.wrench_on_hand_W.f, same.wrench_on_hand_W.f);
    compared += told.answered_input.value != step;
  }
  EXPECT_GT(compared, 500U) << "nothing was played late, so nothing was tested";
}

TEST_F(RoomBridge, TheJointComesWithASecondHandOnTheBodyAndGoesAfterIt) {
  Bench bench(scene_);
  bench.join(0);
  bench.join(1);
  std::uint64_t tick = 0;
  const auto step = [&](bool second_holds) {
    ++tick;
    bench.room.input(0).publish(input(tick, {-0.03, 0, 0}, proto::ClientMode::kLocalModel, kButtonGrab));
    bench.room.input(1).publish(
        input(tick, {0.03, 0, 0}, proto::ClientMode::kHandle, second_holds ? std::uint32_t{kButtonGrab} : 0U));
    return bench.step();
  };
  proto::ServerUpdate told;
  for (int i = 0; i < 300; ++i) told = step(false);
  ASSERT_TRUE(told.held_body.is_valid());
  EXPECT_EQ(told.joint_share, 0) << "nobody else has a hand on it";
  EXPECT_EQ(told.bodies.at(0).hands, 1U);
  double before = 0;
  int rising = 0;
  while (told.joint_share < 1 && rising < 1000) {
    told = step(true);
    EXPECT_LE(told.joint_share - before, 0.02) << "a jump would be felt";
    before = told.joint_share;
    ++rising;
  }
  EXPECT_LE(rising, 105);
  EXPECT_EQ(told.bodies.at(0).hands, 2U);
  int kept = 0, falling = 0;
  while (told.joint_share >= 1 && kept < 2000) {
    told = step(false);
    ++kept;
  }
  while (told.joint_share > 0 && falling < 2000) {
    told = step(false);
    ++falling;
  }
  EXPECT_NEAR(kept, 500, 5);
  EXPECT_NEAR(falling, 200, 5);
}

TEST_F(RoomBridge, TheJointPullsTheBodyToTheClientsCopy) {
  Bench bench(scene_);
  bench.join(0);
  bench.join(1);
  proto::ServerUpdate told;
  for (std::uint64_t tick = 1; tick <= 1500; ++tick) {
    // The user's handle stays, but the user's own copy of the body is 5 mm farther: a body that two hold follows both.
    proto::ClientUpdate mine = input(tick, {-0.03, 0, 0}, proto::ClientMode::kLocalModel, kButtonGrab);
    mine.tool.X.p.y() += 0.005;
    CopyTarget copy{BodyId{1}, {}, Vec3(-0.03, 0, 0), Vec3::Zero()};
    copy.state.X.p.y() = 0.005;
    mine.copies.push_back(copy);
    bench.room.input(0).publish(mine);
    bench.room.input(1).publish(input(tick, {0.03, 0, 0}, proto::ClientMode::kHandle, kButtonGrab));
    told = bench.step();
  }
  ASSERT_EQ(told.joint_share, 1);
  EXPECT_GT(told.bodies.at(0).state.X.p.y(), 0.001);
  EXPECT_LT(told.bodies.at(0).state.X.p.y(), 0.005);
  EXPECT_EQ(told.slowest_loop, std::chrono::milliseconds(60)) << "the other one has no copies";
}

TEST_F(RoomBridge, AGraspIsOfTheInputThatPressed) {
  Bench bench(scene_);
  bench.join(0);
  constexpr std::uint64_t kPressed = 404;
  proto::ServerUpdate before, told;
  for (std::uint64_t step = 1; step <= 500 && !told.held_body.is_valid(); ++step) {
    // Ten at a time, of which the newest is kept: the playout has to wait for them.
    if (step % 10 == 0) {
      bench.room.input(0).publish(input(step, {-0.03, 0, 0}, proto::ClientMode::kLocalModel,
                                        step >= kPressed ? std::uint32_t{kButtonGrab} : 0U));
    }
    before = told;
    told = bench.step();
  }
  ASSERT_TRUE(told.held_body.is_valid());
  EXPECT_GT(told.playout, std::chrono::milliseconds(4)) << "played at once, so nothing was tested";
  // That input was lost; the one before had the button up, the one after down: somewhere between.
  EXPECT_GT(told.answered_input, Tick{400});
  EXPECT_LE(before.answered_input, Tick{400});
}

TEST_F(RoomBridge, ASharedBodyHangsInTheCopyOfWhoAloneHoldsIt) {
  Bench bench(physics::load_parts({.bodies = R"({"name": "box", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}],
                                        "mass_kg": 0.2, "graspable": true})",
                                   .tools = kTwoTools}));
  bench.join(0);
  bench.join(1);
  std::uint64_t tick = 0;
  const auto height_after = [&](std::uint32_t first, std::uint32_t second) {
    proto::ServerUpdate told;
    for (int i = 0; i < 2500; ++i) {
      ++tick;
      for (const std::uint8_t seat : {0, 1}) {
        const Vec3 p(seat == 0 ? -0.03 : 0.03, 0, 0);
        proto::ClientUpdate update = input(tick, p, proto::ClientMode::kLocalModel, seat == 0 ? first : second);
        update.copies.push_back({BodyId{1}, {}, p, Vec3::Zero()});
        bench.room.input(seat).publish(update);
      }
      told = bench.step();
    }
    EXPECT_EQ(told.joint_share, 1);
    return told.bodies.at(0).state.X.p.z();
  };
  // Both copies are kept at the origin; of two who hold it, the two joints bear the weight.
  const Duration loop = std::chrono::milliseconds(60);
  const double sag_m = 0.2 * 9.81 / (2 * physics::DelayedJoint::joint(loop, loop, Vec3::Zero()).stiffness_n_per_m);
  EXPECT_NEAR(height_after(kButtonGrab, kButtonGrab), -sag_m, 1e-4);
  EXPECT_NEAR(height_after(0, kButtonGrab), 0, 1e-4);
  EXPECT_NEAR(height_after(0, 0), -sag_m, 1e-4);
}

TEST_F(RoomBridge, TheGraspIsToldAsThePlaceOfTheToolOnTheBody) {
  Bench bench(scene_);
  bench.join(0);
  proto::ServerUpdate told;
  for (std::uint64_t tick = 1; tick <= 400; ++tick) {
    const Vec3 p = Vec3(-0.03, 0, 0) + Vec3(0.0001, 0.0002, 0) * static_cast<double>(tick);
    bench.room.input(0).publish(input(tick, p, proto::ClientMode::kHandle, kButtonGrab));
    told = bench.step();
  }
  ASSERT_TRUE(told.held_body.is_valid());
  const Pose& X_WB = told.bodies.at(0).state.X;
  EXPECT_LE(((X_WB * told.X_BT).p - told.tool.X.p).norm(), 1e-12);
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
  proto::ServerUpdate told = bench.step();
  EXPECT_EQ(told.answered_input, Tick{201}) << "the newest, at once";
  EXPECT_EQ(told.playout, Duration{0});
  bench.join(0);
  told = bench.step();
  EXPECT_EQ(told.answered_input, Tick{0});
}

TEST_F(RoomBridge, WavesMoveTheToolWhereTheHandIsAndAreAnswered) {
  Bench bench(scene_);
  bench.join(0);
  haptics::WaveHandPort hand(haptics::WaveImpedance{}, haptics::WavePlayer::Settings{});
  proto::ServerUpdate told;
  Wrench largest;
  for (std::uint64_t tick = 1; tick <= 3000; ++tick) {
    // 2 cm away from the box within the first second.
    const Pose X_WH{Vec3(-0.03 - 0.02 * std::min(1.0, static_cast<double>(tick) / 1000), 0, 0), Quat::Identity()};
    if (tick > 1) hand.receive(std::chrono::milliseconds(tick - 1), told.wave);
    const Wrench on_hand = hand.tick(X_WH, 1e-3);
    hand.set_displayed(on_hand);
    if (on_hand.f.norm() > largest.f.norm()) largest = on_hand;
    proto::ClientUpdate update = input(tick, X_WH.p, proto::ClientMode::kWave);
    update.wave = hand.sum_towards_tool();
    bench.room.input(0).publish(update);
    told = bench.step();
    ASSERT_TRUE(is_finite(told.wave));
  }
  EXPECT_NEAR(told.tool.X.p.x(), -0.05, 0.003);
  EXPECT_GT(told.wave.f.norm(), 0);
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

}  // namespace
}  // namespace tandem::server
