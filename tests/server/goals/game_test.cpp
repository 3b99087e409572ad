// Tests games in a room: goals, levels, time, and the effect of games on the force on a hand.
#include "server/goals/game.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "server/goals/game_codec.hpp"
#include "server/recording/room_checkpoint.hpp"
#include "server/recording/step_codec.hpp"
#include "tests/server/goals/game_room.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::server {
namespace {

using Kind = GameEvent::Kind;
using ::testing::ElementsAre;

constexpr const char* kAnywhere = R"({"in_region": {"body": "ball", "region": {"sphere": {"radius_m": 1}}}})";
constexpr const char* kNowhere = R"({"in_region": {"body": "ball", "region": {"sphere": {"radius_m": 0.001}}}})";

std::string goal(const std::string& name, const std::string& condition, const std::string& more = "") {
  return R"({"name": ")" + name + R"(", "conditions": [)" + condition + "]" + more + "}";
}

std::shared_ptr<const LoadedScene> scene_with(const std::string& game, const std::string& more_bodies = "") {
  return test::scene_of(small_game(game, more_bodies));
}

TEST(Game, AHandPutsTheBallIntoTheRingInTime) {
  TANDEM_LOAD_SCENE(scene, "ring");
  GameRoom game(scene);
  game.join(0);
  play_ring(game);
  game.run(1);
  ASSERT_THAT(game.kinds(),
              ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kGoalReached, Kind::kLevelReached, Kind::kWon));
  const double seconds = static_cast<double>(game.status().steps) / 1000;
  EXPECT_LT(seconds, 20);
  EXPECT_NEAR(game.status().score, 10 + (20 - seconds), 0.002);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
}

TEST(Game, AHandThatDoesNothingLosesWhenTheTimeIsOver) {
  TANDEM_LOAD_SCENE(scene, "ring");
  GameRoom game(scene);
  game.join(0);
  game.run(20.5);
  ASSERT_THAT(game.kinds(),
              ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kGoalFailed, Kind::kLevelFailed, Kind::kLost));
  EXPECT_EQ(game.events[2].step.value - game.events[0].step.value + 1, 20'000U);
  EXPECT_TRUE(game.events[2].by_time);
  EXPECT_EQ(game.status().score, 0);
}

TEST(Game, TheSameInputsGiveTheSameStatusInEachStep) {
  TANDEM_LOAD_SCENE(scene, "ring");
  std::vector<std::uint32_t> first;
  for (int run = 0; run < 2; ++run) {
    GameRoom game(scene);
    game.join(0);
    std::vector<std::uint32_t> hashes;
    class Watch final : public RoomWatcher {
     public:
      explicit Watch(std::vector<std::uint32_t>& hashes) : hashes_(hashes) {}
      void on_command(const RoomCommand&) noexcept override {}
      void on_input(std::size_t, const proto::ClientUpdate&) noexcept override {}
      void on_step(const Room& room, ServerTime, TickFaults) noexcept override {
        hashes_.push_back(hash_of(room.game()->status()));
        EXPECT_EQ(hashes_of(room).bodies.back(), hashes_.back());
      }

     private:
      std::vector<std::uint32_t>& hashes_;
    } watch(hashes);
    game.room.watch(watch);
    play_ring(game);
    if (run == 0) first = hashes;
    EXPECT_EQ(hashes, first);
    EXPECT_GT(std::set(hashes.begin(), hashes.end()).size(), 1000U);
  }
}

TEST(Game, TheClockRunsOnlyWhileEnoughPlayersAreHere) {
  GameRoom game(scene_with(R"({"players": 2, "levels": [{"name": "a", "goals": [)" + goal("g", kNowhere) + "]}]}"));
  game.join(0);
  game.run(0.1);
  EXPECT_EQ(game.status().phase, GamePhase::kWaiting);
  game.join(1);
  game.run(0.1);
  EXPECT_EQ(game.status().steps, 100U);
  game.leave(1);
  game.run(0.1);
  EXPECT_EQ(game.status().steps, 100U);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
}

TEST(Game, GoalsInOrderOpenOneAfterTheOther) {
  GameRoom game(scene_with(
      R"({"levels": [{"name": "a", "in_order": true, "goals": [)" + goal("first", kAnywhere, R"(, "hold_s": 0.05)") +
      "," + goal("second", kAnywhere, R"(, "time_limit_s": 1, "score": 2, "score_per_s": 10)") + "]}]}"));
  game.join(0);
  game.run(0.03);
  EXPECT_EQ(game.status().goals[0].status, GoalStatus::kOpen);
  EXPECT_EQ(game.status().goals[1].status, GoalStatus::kWaiting);
  game.run(0.1);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
  // The first goal scores 1. The second goal scores 2, and 10 for each second that remains of its 1000 steps (1 s). It
  // is reached after one step, so 0.999 s remain.
  EXPECT_NEAR(game.status().score, 3 + 9.99, 1e-9);
}

TEST(Game, AConditionMustHoldWithoutInterruption) {
  GameRoom game(scene_with(R"({"levels": [{"name": "a", "goals": [)" +
                           goal("held", R"({"held": {"body": "ball"}})", R"(, "hold_s": 0.2)") + "]}]}"));
  game.join(0);
  game.move(0, {0, 0, 0.045});
  for (int i = 0; i < 3; ++i) {
    game.hands[0].is_pressed = true;
    game.run(0.15);
    EXPECT_EQ(game.status().goals[0].satisfied, 1);
    game.hands[0].is_pressed = false;
    game.run(0.05);
  }
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
  game.hands[0].is_pressed = true;
  game.run(0.25);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
}

TEST(Game, AtLeastSoManyConditionsAreEnough) {
  const std::string three = std::string(kAnywhere) + "," + kNowhere + "," + kAnywhere;
  GameRoom two(scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", three, R"(, "at_least": 2)") + "]}]}"));
  two.join(0);
  two.run(0.01);
  EXPECT_EQ(two.status().phase, GamePhase::kWon);
  GameRoom all(scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", three) + "]}]}"));
  all.join(0);
  all.run(0.01);
  EXPECT_EQ(all.status().goals[0].satisfied, 2);
  EXPECT_EQ(all.status().phase, GamePhase::kPlaying);
}

TEST(Game, AFailedLevelRepeatsWithoutTheScoreOfItsTry) {
  GameRoom game(scene_with(R"({"levels": [{"name": "a", "repeats": true, "time_limit_s": 1, "goals": [)" +
                           goal("got", kAnywhere) + "," + goal("missed", kNowhere) + "]}]}"));
  game.join(0);
  game.run(0.05);
  EXPECT_EQ(game.status().total(), 1);
  game.run(3);
  const std::vector<Kind> kinds = game.kinds();
  EXPECT_EQ(std::ranges::count(kinds, Kind::kLevelFailed), 3);
  EXPECT_EQ(std::ranges::count(kinds, Kind::kLevelStarted), 4);
  EXPECT_EQ(game.status().total(), 1);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
}

TEST(Game, AnExtraGoalIsNotNeededForTheLevel) {
  GameRoom game(scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", kAnywhere, R"(, "hold_s": 0.1)") +
                           "," + goal("x", kNowhere, R"(, "extra": true, "time_limit_s": 0.05)") + "]}]}"));
  game.join(0);
  game.run(0.2);
  EXPECT_THAT(game.kinds(), ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kGoalFailed, Kind::kGoalReached,
                                        Kind::kLevelReached, Kind::kWon));
}

TEST(Game, TheTimeOfTheWholeGameEndsIt) {
  GameRoom game(scene_with(R"({"time_limit_s": 2.5, "levels": [{"name": "a", "repeats": true, "time_limit_s": 1,
                               "goals": [)" +
                           goal("g", kNowhere) + "]}]}"));
  game.join(0);
  game.run(3);
  EXPECT_EQ(game.status().phase, GamePhase::kLost);
  EXPECT_EQ(game.status().steps, 2500U);
}

constexpr const char* kTwoCubes =
    R"(, {"name": "light", "shapes": [{"box": {"size_m": [0.03, 0.03, 0.03]}}], "mass_kg": 0.1, "graspable": true,
          "placement": {"position_m": [0.2, 0, 0.015]}},
         {"name": "heavy", "shapes": [{"box": {"size_m": [0.03, 0.03, 0.03]}}], "mass_kg": 0.4, "graspable": true,
          "placement": {"position_m": [0.2, 0, 0.015]}},
         {"name": "shelf", "shapes": [{"box": {"size_m": [0.1, 0.1, 0.01]}}], "placement": {"position_m": [-0.2, 0, 0.1]}})";

std::string two_levels(const std::string& first, const std::string& second) {
  return R"({"users_choose": true, "levels": [
      {"name": "a", "bodies": ["light", "shelf"], "goals": [)" +
         goal("g", kNowhere) + "]" + first + R"(},
      {"name": "b", "bodies": ["heavy"], "goals": [)" +
         goal("g", kNowhere) + "]" + second + "}]}";
}

bool exists(const GameRoom& game, std::size_t body) {
  return !game.room.game()->is_absent(body_id_at(body)) && !game.room.world().is_absent(body_id_at(body));
}

TEST(Game, EachLevelHasItsBodies) {
  GameRoom game(scene_with(two_levels("", ""), kTwoCubes));
  game.join(0);
  game.run(0.1);
  EXPECT_TRUE(exists(game, 2) && !exists(game, 3) && exists(game, 4));
  const auto listed = [&game] {
    game.room.output().poll();
    std::vector<std::uint32_t> ids;
    for (const proto::BodyState& body : game.room.output().front().bodies) ids.push_back(body.id.value);
    return ids;
  };
  EXPECT_THAT(listed(), ElementsAre(2U, 3U));
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(0.1);
  EXPECT_TRUE(!exists(game, 2) && exists(game, 3) && !exists(game, 4));
  EXPECT_THAT(listed(), ElementsAre(2U, 4U));
  // A body that does not exist must neither fall nor be grasped.
  game.run(0.5);
  EXPECT_NEAR(game.room.world().body(body_id_at(2)).X.p.z(), 0.015, 1e-4);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 0});
  game.run(0.1);
  EXPECT_TRUE(exists(game, 2) && !exists(game, 3) && exists(game, 4));
}

TEST(Game, ABodyThatRestsOnALeavingShelfFalls) {
  GameRoom game(scene_with(
      two_levels("", ""),
      std::string(kTwoCubes) +
          R"(, {"name": "egg", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.05, "placement": {"position_m": [-0.2, 0, 0.115]}})"));
  game.join(0);
  game.run(1.5);  // the egg comes to rest and is put to sleep by the simulation
  EXPECT_NEAR(game.room.world().body(body_id_at(5)).X.p.z(), 0.115, 1e-3);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(1);
  EXPECT_NEAR(game.room.world().body(body_id_at(5)).X.p.z(), 0.01, 1e-3);
}

/// Returns the largest change of the force on the hand between two steps, within `seconds`.
double largest_force_step_n(GameRoom& game, double seconds) {
  double most_n = 0;
  Vec3 before = game.room.world().tool(0).wrench_on_hand_W.f;
  const auto count = static_cast<int>(seconds * 1000);
  for (int i = 0; i < count; ++i) {
    game.step();
    const Vec3 now = game.room.world().tool(0).wrench_on_hand_W.f;
    most_n = std::max(most_n, (now - before).norm());
    before = now;
  }
  return most_n;
}

constexpr double kMaxForceStep_n = 0.1;

TEST(Game, ALevelChangeUnderAPressingHandMakesNoForceStep) {
  const std::string second =
      R"(, "gravity_m_per_s2": [0, 0, -3], "returns_bodies": true, "law": "stable-dynamic",
          "parameters": [{"name": "coupling.stiffness_n_per_m", "value": 600}, {"name": "coupling.damping_n_s_per_m", "value": 5}])";
  for (const Vec3& pressed : {Vec3(0, 0, -0.01), Vec3(0.2, 0, 0.025), Vec3(-0.2, 0, 0.1)}) {
    GameRoom game(scene_with(two_levels("", second), kTwoCubes));
    game.join(0);
    game.move(0, Vec3(pressed.x(), 0, 0.15));
    game.move(0, pressed);
    game.run(0.5);
    EXPECT_GT(game.room.world().tool(0).wrench_on_hand_W.f.norm(), 0.3) << "the hand must press";
    game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
    EXPECT_LE(largest_force_step_n(game, 1), kMaxForceStep_n) << pressed.transpose();
    EXPECT_EQ(game.status().level, 1);
  }
}

TEST(Game, ALevelChangeToAnotherCouplingUnderAPressingHandMakesNoForceStep) {
  struct Coupling {
    const char* law;
    double stiffness_n_per_m, damping_n_s_per_m;
  };
  const std::vector<Coupling> couplings{{"spring-damper", 300, 3},
                                        {"spring-damper", 2000, 20},
                                        {"spring-damper", 100, 1},
                                        {"stable-dynamic", 400, 4},
                                        {"stable-dynamic", 1500, 10}};
  const auto of_level = [](const Coupling& coupling) {
    return R"(, "law": ")" + std::string(coupling.law) +
           R"(", "parameters": [{"name": "coupling.stiffness_n_per_m", "value": )" +
           std::to_string(coupling.stiffness_n_per_m) + R"(}, {"name": "coupling.damping_n_s_per_m", "value": )" +
           std::to_string(coupling.damping_n_s_per_m) + "}]";
  };
  for (const Coupling& from : couplings) {
    for (const Coupling& to : couplings) {
      GameRoom game(scene_with(two_levels(of_level(from), of_level(to)), kTwoCubes));
      game.join(0);
      game.move(0, {0, 0, 0.15});
      game.move(0, {0, 0, -0.01});
      game.run(0.5);
      EXPECT_GT(game.room.world().tool(0).wrench_on_hand_W.f.norm(), 0.3) << "the hand must press";
      game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
      const double there_n = largest_force_step_n(game, 0.05);
      // The second change interrupts the fade of the first.
      game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 0});
      const double back_n = largest_force_step_n(game, 0.6);
      EXPECT_LE(std::max(there_n, back_n), kMaxForceStep_n)
          << from.law << " " << from.stiffness_n_per_m << " to " << to.law << " " << to.stiffness_n_per_m;
    }
  }
}

TEST(Game, ALevelChangeWithABodyInTheHandMakesNoForceStep) {
  GameRoom game(scene_with(two_levels("", R"(, "gravity_m_per_s2": [0, 0, 0])"), kTwoCubes));
  game.join(0);
  game.move(0, {0.2, 0, 0.035});
  game.hands[0].is_pressed = true;
  game.run(0.2);
  game.move(0, {0.2, 0, 0.12});
  game.run(0.5);
  ASSERT_EQ(game.room.world().tool(0).held, body_id_at(2));
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  EXPECT_LE(largest_force_step_n(game, 1), kMaxForceStep_n);
  EXPECT_TRUE(exists(game, 2)) << "a held body stays until it is released";
  game.hands[0].is_pressed = false;
  game.run(0.5);
  game.move(0, {0, 0.3, 0.3});
  game.run(0.5);
  EXPECT_FALSE(exists(game, 2));
  EXPECT_TRUE(exists(game, 3));
}

TEST(Game, GravityIsSwitchedByARampInWhichNoForceJumps) {
  GameRoom game(scene_with(two_levels("", ""), kTwoCubes));
  game.join(0);
  game.move(0, {0.2, 0, 0.035});
  game.hands[0].is_pressed = true;
  game.run(0.2);
  game.move(0, {0.2, 0, 0.1});
  game.run(0.5);
  const double weight_n = -game.room.world().tool(0).wrench_on_hand_W.f.z();
  EXPECT_NEAR(weight_n, 0.1 * 9.81, 0.01);
  game.command({.kind = RoomCommand::Kind::kSetWeight, .is_weightless = true});
  EXPECT_LE(largest_force_step_n(game, 1), kMaxForceStep_n);
  EXPECT_NEAR(game.room.world().tool(0).wrench_on_hand_W.f.z(), 0, 0.01);
  game.command({.kind = RoomCommand::Kind::kSetWeight, .is_weightless = false});
  EXPECT_LE(largest_force_step_n(game, 1), kMaxForceStep_n);
  EXPECT_NEAR(-game.room.world().tool(0).wrench_on_hand_W.f.z(), weight_n, 0.01);
}

TEST(Game, AFreeBodyHasTheGravityOfTheFirstLevelAtOnce) {
  const std::string weightless =
      R"({"levels": [{"name": "a", "gravity_m_per_s2": [0, 0, 0], "goals": [)" + goal("g", kNowhere) + "]}]}";
  const auto scene = scene_with(
      weightless,
      R"(, {"name": "egg", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.05, "placement": {"position_m": [-0.3, 0, 0.3]}})");
  GameRoom game(scene);
  game.run(0.5);
  EXPECT_NEAR(game.room.world().body(body_id_at(2)).X.p.z(), 0.3, 1e-9);
  const auto state = state_of(checkpoint_of(game.room), *scene);
  ASSERT_TRUE(state.has_value());
  GameRoom after(scene);
  after.room.resume(*state);
  after.run(0.5);
  EXPECT_NEAR(after.room.world().body(body_id_at(2)).X.p.z(), 0.3, 1e-9);
}

TEST(Game, SleepingBodiesFeelAChangeOfGravity) {
  GameRoom game(scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", kNowhere) + R"(]},
      {"name": "up", "gravity_m_per_s2": [0, 0, 1], "goals": [)" +
                           goal("g", kNowhere) + "]}]}"));
  game.join(0);
  game.move(0, {0.4, 0, 0.1});
  game.run(2);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(0.6);
  EXPECT_GT(game.room.world().body(body_id_at(1)).X.p.z(), 0.05);
}

TEST(Game, ABodyDoesNotReturnIntoAHandAtItsStart) {
  GameRoom game(scene_with(two_levels("", R"(, "returns_bodies": true)"), kTwoCubes));
  game.join(0);
  game.move(0, {0, 0, 0.045});
  game.hands[0].is_pressed = true;
  game.run(0.2);
  ASSERT_EQ(game.room.world().tool(0).held, body_id_at(1));
  game.move(0, {0, 0.1, 0.05});
  game.run(0.3);
  game.hands[0].is_pressed = false;
  game.run(0.5);
  game.move(0, {0, 0.1, 0.15});
  game.move(0, {0, 0, 0.15});
  game.move(0, {0, 0, 0.02});
  game.run(0.5);
  const double before_m = game.room.world().body(body_id_at(1)).X.p.y();
  ASSERT_GT(before_m, 0.05);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(0.1);
  EXPECT_NEAR(game.room.world().body(body_id_at(1)).X.p.y(), before_m, 0.01);
  game.move(0, {0, 0, 0.15});
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(0.1);
  EXPECT_NEAR(game.room.world().body(body_id_at(1)).X.p.y(), 0, 1e-3) << "without a hand it returns";
}

TEST(Game, AStartedLevelIsAnEventOfItsStep) {
  GameRoom game(scene_with(two_levels("", ""), kTwoCubes));
  game.join(0);
  game.run(0.1);
  game.events.clear();
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  game.run(0.1);
  ASSERT_THAT(game.kinds(), ElementsAre(Kind::kLevelStarted));
  EXPECT_EQ(game.events[0].step.value, 101U);
}

TEST(Game, AWholeBodyWithoutSolidShapesIsInARegionWithItsOrigin) {
  const auto loaded = scene_with(
      R"({"levels": [{"name": "a", "goals": [)" +
      goal("g", R"({"in_region": {"body": "ball", "whole": true, "region": {"sphere": {"radius_m": 0.1}}}})") + "]}]}");
  LoadedScene scene = *loaded;
  scene.body_shapes[1].clear();
  const auto plan = make_game_plan(scene);
  const GoalCondition& condition = plan->levels[0].goals[0].conditions[0].condition;
  const auto& in_region = std::get<InRegionCondition>(condition);
  ASSERT_EQ(in_region.balls.size(), 1U);
  EXPECT_EQ(in_region.balls[0].p_B, Vec3(Vec3::Zero()));
}

TEST(Game, TimeWithoutPlayersInterruptsAHold) {
  GameRoom game(scene_with(R"({"players": 2, "levels": [{"name": "a", "goals": [)" +
                           goal("g", kAnywhere, R"(, "hold_s": 0.2)") + "]}]}"));
  game.join(0);
  game.join(1);
  game.run(0.15);
  game.leave(1);
  game.run(0.1);
  EXPECT_EQ(game.status().goals[0].held_steps, 0U);
  game.join(1);
  game.run(0.15);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
  game.run(0.1);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
}

TEST(Game, AReservedToolDoesNotBringBackABodyThatItsLevelLacks) {
  const auto scene = scene_with(two_levels("", ""), kTwoCubes);
  GameRoom before(scene);
  before.join(0);
  before.command({.kind = RoomCommand::Kind::kStartLevel, .level = 1});
  before.run(0.1);
  auto state = state_of(checkpoint_of(before.room), *scene);
  ASSERT_TRUE(state.has_value());
  ASSERT_FALSE(state->tools.empty());
  state->tools[0].held = body_id_at(2);
  GameRoom after(scene);
  after.room.resume(*state);
  after.run(0.1);
  EXPECT_FALSE(exists(after, 2));
  after.join(0);
  after.run(0.1);
  EXPECT_FALSE(exists(after, 2));
  EXPECT_FALSE(after.room.world().tool(0).held.is_valid());
  after.command({.kind = RoomCommand::Kind::kPlace, .body = body_id_at(2), .beside = body_id_at(0), .X_SB = {}});
  after.run(0.1);
  EXPECT_FALSE(exists(after, 2));
}

TEST(Game, AResetOfTheRoomStartsTheGameAnew) {
  TANDEM_LOAD_SCENE(scene, "ring");
  GameRoom game(scene);
  game.join(0);
  play_ring(game);
  game.run(1);
  ASSERT_EQ(game.status().phase, GamePhase::kWon);
  game.command({.kind = RoomCommand::Kind::kReset});
  game.run(0.1);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
  EXPECT_EQ(game.status().total(), 0);
  EXPECT_EQ(game.status().steps, 100U);
}

TEST(Game, ARoomThatResumesContinuesTheLevelWithTheSameScoreAndTime) {
  const auto scene = scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", kAnywhere) + R"(]},
      {"name": "b", "bodies": ["light"], "goals": [)" +
                                    goal("got", kAnywhere, R"(, "score": 5)") + "," +
                                    goal("later", kNowhere, R"(, "time_limit_s": 3)") + "]}]}",
                                kTwoCubes);
  GameRoom before(scene);
  before.join(0);
  before.run(1.5);
  ASSERT_EQ(before.status().level, 1);
  const wire::RoomCheckpoint saved = checkpoint_of(before.room);
  const auto state = state_of(saved, *scene);
  ASSERT_TRUE(state.has_value());
  GameRoom after(scene);
  after.room.resume(*state);
  EXPECT_EQ(hash_of(after.status()), hash_of(before.status()));
  after.run(1);  // no user is present, so the game's clock is stopped
  after.join(0);
  after.step();
  EXPECT_EQ(after.status().steps, before.status().steps + 1);
  EXPECT_EQ(after.status().total(), 6);
  EXPECT_TRUE(exists(after, 2));
  after.run(3);
  EXPECT_EQ(after.status().phase, GamePhase::kLost) << "the time limit counts from the start of the level";
  before.run(3);
  EXPECT_EQ(before.status().steps, after.status().steps);
}

TEST(Game, AStoredStateOfAnotherGameIsNotUsed) {
  const auto scene = scene_with(R"({"levels": [{"name": "a", "goals": [)" + goal("g", kNowhere) + "]}]}");
  GameRoom game(scene);
  GameStatus stored = game.status();
  stored.score = 7;
  physics::World world = make_server_world(scene);
  Game fresh(*scene, *make_game_plan(*scene));
  fresh.restart(world, 0);
  EXPECT_TRUE(fresh.resume(stored, world));
  EXPECT_EQ(fresh.status().score, 7);
  stored.level = 1;
  EXPECT_FALSE(fresh.resume(stored, world));
  stored.level = 0;
  stored.goals.push_back({});
  EXPECT_FALSE(fresh.resume(stored, world));
  stored.goals.pop_back();
  stored.score = std::nan("");
  EXPECT_FALSE(fresh.resume(stored, world));
  EXPECT_EQ(fresh.status().score, 7);
  wire::GameCheckpoint message;
  write_checkpoint(fresh.status(), message);
  EXPECT_TRUE(read_checkpoint(message).has_value());
  message.set_level(kMaxLevels);
  EXPECT_FALSE(read_checkpoint(message).has_value());
  message.set_level(0);
  for (std::size_t i = 0; i < kMaxGoalsPerLevel; ++i) message.add_goals();
  EXPECT_FALSE(read_checkpoint(message).has_value());
}

TEST(Game, AStepWithAGameAllocatesNothing) {
  TANDEM_LOAD_SCENE(scene, "ring");
  GameRoom game(scene);
  game.join(0);
  game.move(0, {-0.08, 0, 0.03});
  game.hands[0].is_pressed = true;
  game.run(0.2);
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 200; ++i) game.room.step(ServerTime(Duration(i)));
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace tandem::server
