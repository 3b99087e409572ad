// Tests the messages that users receive about a game, and which users may start its levels.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/goals/game_room.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string scene_json(const std::string& more = "") {
  const std::string goal =
      R"({"name": "g", "hold_s": 0.5, "score": 3, "conditions": [{"in_region": {"body": "ball", "region": {"sphere": {"radius_m": 1}}}}]})";
  return small_game(R"({)" + more + R"("levels": [
      {"name": "a", "goals": [)" +
                        goal + R"(], "parameters": [{"name": "coupling.stiffness_n_per_m", "value": 250}]},
      {"name": "b", "bodies": ["cube"], "goals": [{"name": "h", "conditions": [{"held": {"body": "cube"}}]}],
       "parameters": [{"name": "coupling.stiffness_n_per_m", "value": 400}]}]})",
                    R"(, {"name": "cube", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.1,
                         "graspable": true, "placement": {"position_m": [0.2, 0, 0.01]}})");
}

wire::ClientControl set(const std::string& name, double value) {
  return test::message_of([&](auto& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
  });
}

struct Received {
  std::vector<wire::GameState> states;
  std::vector<wire::GameEvent::Kind> events;
  std::vector<double> stiffness;
};

Received received(const std::vector<wire::ServerControl>& messages) {
  Received out;
  for (const wire::ServerControl& message : messages) {
    if (message.has_game_state()) out.states.push_back(message.game_state());
    if (message.has_game_event()) out.events.push_back(message.game_event().kind());
    const bool is_stiffness = message.parameter_set().name() == "coupling.stiffness_n_per_m";
    if (message.has_parameter_set() && is_stiffness) out.stiffness.push_back(message.parameter_set().value());
  }
  return out;
}

/// Steps the bench while a user sends input, so that the user does not time out.
void keep_alive(test::HubBench& bench, test::BenchClient& client, int steps) {
  for (int i = 0; i < steps; ++i) {
    bench.send_state(client);
    bench.step();
  }
}

TEST(SessionGames, UsersReceiveEventsAndOneStateASecond) {
  test::HubBench bench({}, {scene_json()});
  test::BenchClient ada = bench.join("ada");
  bench.step(480);
  Received first = received(bench.drain(ada));
  EXPECT_THAT(first.events, ElementsAre(wire::GameEvent::STARTED, wire::GameEvent::LEVEL_STARTED));
  ASSERT_FALSE(first.states.empty());
  EXPECT_EQ(first.states.back().goals_size(), 1);
  EXPECT_THAT(first.states.back().absent_bodies(), ElementsAre(3U));
  bench.step(40);
  Received second = received(bench.drain(ada));
  EXPECT_THAT(second.events, ElementsAre(wire::GameEvent::GOAL_REACHED, wire::GameEvent::LEVEL_REACHED,
                                         wire::GameEvent::LEVEL_STARTED));
  ASSERT_FALSE(second.states.empty());
  EXPECT_EQ(second.states.back().level(), 1U);
  EXPECT_EQ(second.states.back().score(), 3);
  EXPECT_EQ(second.states.back().absent_bodies_size(), 0);
  EXPECT_THAT(second.stiffness, ElementsAre(400)) << "the coupling of the level is announced";
  keep_alive(bench, ada, 1000);
  const std::size_t states = received(bench.drain(ada)).states.size();
  EXPECT_GE(states, 1U);
  EXPECT_LE(states, 2U);
}

TEST(SessionGames, ANewcomerReceivesTheState) {
  test::HubBench bench({}, {scene_json()});
  bench.join("ada");
  bench.step(200);
  test::BenchClient ben = bench.connect();
  bench.greet(ben);
  bench.send(ben, test::HubBench::join_message("ben"));
  const auto messages = bench.drain(ben);
  EXPECT_THAT(test::described(messages), HasSubstr("game_state"));
  EXPECT_EQ(messages[0].joined().scene().coupling().stiffness_n_per_m(), 250) << "that of the level";
}

TEST(SessionGames, TheOperatorStartsLevelsAndOthersMayNot) {
  test::HubBench bench({}, {scene_json()});
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient ben = bench.join("ben");
  bench.step(10);
  bench.drain(ada);
  bench.send(ben, set("game.level", 2));
  EXPECT_THAT(test::described(bench.drain(ben)), HasSubstr("error ERROR_NOT_ALLOWED"));
  bench.send(ada, set("game.level", 2));
  bench.step(2);
  const auto messages = bench.drain(ada);
  EXPECT_THAT(test::described(messages), HasSubstr("parameter_set"));
  EXPECT_EQ(received(messages).states.back().level(), 1U);
  for (const double bad : {0.0, 3.0, -1.0, 1.5}) {
    keep_alive(bench, ada, 1000);
    bench.drain(ada);
    bench.send(ada, set("game.level", bad));
    EXPECT_THAT(test::described(bench.drain(ada)), HasSubstr("error ERROR_BAD_VALUE")) << bad;
  }
}

TEST(SessionGames, InAGameOfChoiceEachManipulatorSwitchesGravityAtALimitedRate) {
  test::HubBench bench({}, {scene_json(R"("users_choose": true, )")});
  test::BenchClient ada = bench.join("ada");
  bench.step(10);
  bench.drain(ada);
  bench.send(ada, set("game.gravity", 0));
  bench.step(2);
  EXPECT_EQ(received(bench.drain(ada)).states.back().gravity_m_per_s2(2), 0);
  bench.send(ada, set("game.gravity", 1));
  bench.step(2);
  EXPECT_EQ(received(bench.drain(ada)).states.back().gravity_m_per_s2(2), -9.81);
  bench.send(ada, set("game.gravity", 0));
  EXPECT_THAT(test::described(bench.drain(ada)), HasSubstr("error ERROR_NOT_ALLOWED")) << "two at once";
  test::BenchClient eve = bench.join("eve", wire::ROLE_OBSERVER);
  bench.now += std::chrono::seconds(1);
  bench.send(eve, set("game.gravity", 0));
  EXPECT_THAT(test::described(bench.drain(eve)), HasSubstr("error ERROR_NOT_ALLOWED"));
}

TEST(SessionGames, RefusedRequestsOfAnObserverLeaveTheRateToThePlayers) {
  test::HubBench bench({}, {scene_json(R"("users_choose": true, )")});
  test::BenchClient ada = bench.join("ada");
  test::BenchClient eve = bench.join("eve", wire::ROLE_OBSERVER);
  bench.step(10);
  for (int i = 0; i < 10; ++i) bench.send(eve, set("game.level", 2));
  bench.drain(ada);
  bench.send(ada, set("game.level", 2));
  EXPECT_THAT(test::described(bench.drain(ada)), HasSubstr("parameter_set"));
}

TEST(SessionGames, ARoomWithoutAGameRefusesItsParameters) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  bench.drain(ada);
  bench.send(ada, set("game.level", 1));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_NOT_ALLOWED");
}

TEST(SessionGames, ACouplingForAnEarlierLevelIsNotAppliedInTheNextOne) {
  for (const bool is_level_first : {true, false}) {
    test::HubBench bench({}, {scene_json()});
    test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
    bench.step(10);
    bench.drain(ada);
    const auto stiffness = [&bench] { return bench.rooms.front()->world().coupling(0).stiffness_n_per_m; };
    EXPECT_NEAR(stiffness(), 250, 1e-9);
    // Sends two commands, which wait in the room's queue until the level begins: the start of level 2, and a stiffness
    // of 20 N/m for the previous level. The stiffness must not be applied in either order.
    if (is_level_first) bench.send(ada, set("game.level", 2));
    bench.send(ada, set("coupling.stiffness_n_per_m", 20));
    if (!is_level_first) bench.send(ada, set("game.level", 2));
    for (int i = 0; i < 400; ++i) {
      bench.step();
      EXPECT_GE(stiffness(), 249.9) << "step " << i;
    }
    EXPECT_NEAR(stiffness(), 400, 1e-9);
    EXPECT_EQ(received(bench.drain(ada)).stiffness.back(), 400) << "and users know it";
    // A stiffness that is set during the level is applied.
    bench.send_state(ada);
    bench.send(ada, set("coupling.stiffness_n_per_m", 300));
    for (int i = 0; i < 300; ++i) {
      bench.send_state(ada);
      bench.step();
    }
    EXPECT_NEAR(stiffness(), 300, 1e-9);
  }
}

TEST(SessionGames, WhenTheOperatorLeavesTheCouplingOfTheLevelReturns) {
  test::HubBench bench({}, {scene_json()});
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient ben = bench.join("ben");
  bench.step(10);
  bench.send(ada, set("coupling.stiffness_n_per_m", 120));
  bench.step(2);
  bench.drain(ben);
  bench.send(ada, test::message_of([](auto& message) { message.mutable_leave(); }));
  bench.step(2);
  EXPECT_THAT(received(bench.drain(ben)).stiffness, ElementsAre(250));
}

}  // namespace
}  // namespace tandem::server
