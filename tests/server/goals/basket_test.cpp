// Tests the shipped scene `basket`: its decision table, and hands that fill the basket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/goals/game_room.hpp"

namespace tandem::server {
namespace {

using Kind = GameEvent::Kind;

/// Options without passivity control of tools. This control lets a tool move bodies only with energy that the client
/// reports as work of the hand. The scripted hands report no work.
constexpr RoomOptions kWithoutPassivity{.controls_tool_passivity = false};
constexpr Vec3::Scalar kBasketX_m = 0.13;
constexpr std::size_t kLevels = 6;

/// Takes a body from its start, and lets it fall into the basket.
void put(GameRoom& game, std::uint8_t hand, const std::string& body, const Vec3& drop) {
  const auto& bodies = game.room.scene().description.bodies();
  const auto number = static_cast<std::size_t>(std::ranges::find(bodies, body, &wire::Body::name) - bodies.begin());
  ASSERT_LT(number, static_cast<std::size_t>(bodies.size())) << body;
  constexpr double kAbove_m = 0.008, kCarried_m = 0.12, kDropped_m = 0.085;
  const Vec3 start = game.room.world().body(body_id_at(number)).X.p;
  const Vec3 at(start.x(), start.y(), 2 * start.z() + kAbove_m);
  const Vec3 up(0, 0, kCarried_m);
  game.move(hand, Vec3(at.x(), at.y(), kCarried_m));
  game.move(hand, at);
  game.hands.at(hand).is_pressed = true;
  game.run(0.2);
  EXPECT_EQ(game.room.world().tool(hand).held, body_id_at(number)) << body;
  game.move(hand, Vec3(at.x(), at.y(), 0) + up);
  const Vec3 over = Vec3(kBasketX_m, 0, 0) + drop;
  game.move(hand, over + up);
  game.move(hand, over + Vec3(0, 0, kDropped_m));
  game.run(0.2);
  game.hands.at(hand).is_pressed = false;
  game.run(0.3);
  game.move(hand, over + up);
  game.move(hand, Vec3(-0.05, hand == 0 ? 0.05 : -0.05, kCarried_m));
}

/// Two hands alternately fill the basket of the current level.
void fill(GameRoom& game) {
  const wire::Level& level = game.room.scene().description.game().levels(game.status().level);
  const std::vector<std::string> things(level.bodies().begin() + 1, level.bodies().end());
  const std::vector<Vec3> drops{{-0.012, 0.012, 0}, {0.012, 0.012, 0}, {0, -0.014, 0}};
  for (std::size_t i = 0; i < things.size(); ++i) put(game, i % 2, things[i], drops[i]);
}

TEST(Basket, TwoHandsFillEachBasketAndReachTheNextLevel) {
  TANDEM_LOAD_SCENE(scene, "basket");
  const std::vector<std::pair<int, int>> levels{{0, 2}, {2, 4}};
  for (const auto& [level, next] : levels) {
    GameRoom game(scene, kWithoutPassivity);
    game.join(0);
    game.join(1);
    game.command({.kind = RoomCommand::Kind::kStartLevel, .level = static_cast<std::uint8_t>(level)});
    game.run(0.5);
    fill(game);
    game.run(1);
    EXPECT_EQ(game.status().level, next);
    EXPECT_GE(game.status().score, 30);
    EXPECT_LT(game.status().score, 39) << "all points are for immediate success only";
    EXPECT_EQ(std::ranges::count(game.kinds(), Kind::kGoalReached), 3);
  }
}

TEST(Basket, TheHardestLevelWinsTheGame) {
  TANDEM_LOAD_SCENE(scene, "basket");
  GameRoom game(scene, kWithoutPassivity);
  game.join(0);
  game.join(1);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 4});
  game.run(0.5);
  fill(game);
  game.run(1);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
}

TEST(Basket, AHighScoreWithANegativeEmotionBringsFriendlierThings) {
  TANDEM_LOAD_SCENE(scene, "basket");
  GameRoom game(scene, kWithoutPassivity);
  game.join(0);
  game.join(1);
  game.run(0.5);
  ASSERT_TRUE(game.room.post({.kind = RoomCommand::Kind::kSetSignal, .signal_value = {-0.8, 0.9, 0}}));
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 0});
  const wire::Level& level = scene->description.game().levels(0);
  const std::vector<Vec3> drops{{-0.012, 0.012, 0}, {0.012, 0.012, 0}, {0, -0.014, 0}};
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(game.room.post({.kind = RoomCommand::Kind::kSetSignal, .signal_value = {-0.8, 0.9, 0}}));
    put(game, static_cast<std::uint8_t>(i % 2), level.bodies(i + 1), drops[static_cast<std::size_t>(i)]);
  }
  game.run(1);
  EXPECT_EQ(scene->description.game().levels(game.status().level).name(), "easy friendly");
}

TEST(Basket, ItsTableIsThatOfTheThesisInEachLevel) {
  TANDEM_LOAD_SCENE(scene, "basket");
  const GamePlan plan = *make_game_plan(*scene);
  ASSERT_EQ(plan.levels.size(), kLevels);
  constexpr std::size_t kNegative = 0, kPositive = 1;
  for (std::size_t i = 0; i < kLevels; ++i) {
    const LevelTable& table = *plan.levels[i].next;
    const std::size_t base = i - i % 2;
    const auto next = [&table](double score, std::optional<std::size_t> state) {
      return table.rows.at(table.row_for(score, state)).level;
    };
    const auto higher = base + 2 < kLevels ? std::optional(base + 2) : std::nullopt;
    EXPECT_EQ(next(30, kNegative), base + 1) << "high and negative: the same level, with friendlier things";
    EXPECT_EQ(next(30, kPositive), higher);
    EXPECT_EQ(next(29.9, kNegative), base >= 2 ? base - 2 : 0);
    EXPECT_EQ(next(29.9, kPositive), i) << "low and positive: the same";
    EXPECT_EQ(next(30, std::nullopt), higher) << "by score alone";
    EXPECT_EQ(next(29.9, std::nullopt), i);
  }
}

TEST(Basket, ThingsGetHeavierAndTheBasketNarrower) {
  TANDEM_LOAD_SCENE(scene, "basket");
  const auto& description = scene->description;
  const auto body = [&description](const std::string& name) {
    return *std::ranges::find(description.bodies(), name, &wire::Body::name);
  };
  double lightest_kg = 0, width_m = 1;
  for (int i = 0; i < static_cast<int>(kLevels); i += 2) {
    double least_kg = 1, most_kg = 0;
    for (const int level : {i, i + 1}) {
      const wire::Level& of = description.game().levels(level);
      for (int k = 1; k < of.bodies_size(); ++k) {
        least_kg = std::min(least_kg, body(of.bodies(k)).mass_kg());
        most_kg = std::max(most_kg, body(of.bodies(k)).mass_kg());
      }
    }
    const double inner_m = body(description.game().levels(i).bodies(0)).shapes(3).box().size_m(0);
    EXPECT_GT(least_kg, lightest_kg);
    EXPECT_LT(inner_m, width_m);
    lightest_kg = most_kg;
    width_m = inner_m;
  }
  EXPECT_EQ(description.coupling().law(), "adaptive");
}

TEST(Basket, TheGameEndsAtItsLimitsAndCallsOnce) {
  TANDEM_LOAD_SCENE(scene, "basket");
  const GamePlan plan = *make_game_plan(*scene);
  EXPECT_EQ(plan.limit_steps, 900'000U);
  ASSERT_TRUE(plan.state_limit.has_value());
  EXPECT_EQ(plan.state_limit->steps, 300'000U);
  EXPECT_EQ(plan.state_limit->state, 0U);
  EXPECT_TRUE(plan.calls_at_time_limit && plan.calls_at_state_limit);
}

}  // namespace
}  // namespace tandem::server
