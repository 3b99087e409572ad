// Tests wrong goals in a scene file: each error must name file, field, value and remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/assets/scene_file.hpp"
#include "tests/server/goals/game_room.hpp"

namespace tandem::server {
namespace {

constexpr const char* kGoal = R"({"name": "g", "conditions": [{"held": {"body": "ball"}}]})";

std::string game_with_goal(const std::string& goal) {
  return R"({"levels": [{"name": "a", "goals": [)" + goal + "]}]}";
}
std::string game_with_condition(const std::string& condition) {
  return game_with_goal(R"({"name": "g", "conditions": [)" + condition + "]}");
}

std::string game_with_signal(const std::string& signal, const std::string& goal = kGoal) {
  return R"({"signals": [)" + signal + R"(], "levels": [{"name": "a", "goals": [)" + goal + "]}]}";
}
std::string game_with_table(const std::string& table) {
  return R"({"signals": [{"name": "calm"}], "levels": [{"name": "a", "next": )" + table + R"(, "goals": [)" + kGoal +
         "]}]}";
}

struct Wrong {
  std::string game;
  std::string error;
};

class WrongGoal : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongGoal, IsRefusedWithFieldValueAndRemedy) {
  try {
    load_scene_text(small_game(GetParam().game), "game.json", "/");
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    EXPECT_EQ(std::string(error.what()), "game.json: " + GetParam().error);
  }
}

const std::string kCondition = "game.levels[0].goals[0].conditions[0]";

INSTANTIATE_TEST_SUITE_P(
    Of, WrongGoal,
    ::testing::Values(
        Wrong{R"({"levels": []})", "game.levels has 0 levels; it must have 1 to 16"},
        Wrong{R"({"levels": [{"name": "a"}]})", "game.levels[0].goals has 0 goals; it must have 1 to 16"},
        Wrong{game_with_goal(R"({"name": "g"})"),
              "game.levels[0].goals[0].conditions has 0 conditions; it must have 1 to 16"},
        Wrong{game_with_condition("{}"),
              kCondition + " has no kind; it must have one of in_region, at_pose, held, slower, silhouette, signal"},
        Wrong{game_with_condition(R"({"held": {"body": "bal"}})"),
              kCondition + ".held.body is \"bal\"; there is no body of that name"},
        Wrong{game_with_condition(R"({"held": {"body": "table"}})"),
              kCondition + ".held.body is \"table\", which is not graspable; set graspable of that body"},
        Wrong{game_with_condition(R"({"signal": {"name": "calm"}})"),
              kCondition + ".signal.name is \"calm\"; it must be the name of one of game.signals"},
        Wrong{game_with_signal(R"({"name": "Calm"})"),
              "game.signals[0].name is \"Calm\"; it must be 1 to 32 characters a-z, 0-9, _ - ."},
        Wrong{game_with_signal(R"({"name": "calm", "max_age_s": 0})"),
              "game.signals[0].max_age_s is 0 s; it must be from 0.1 to 600 s"},
        Wrong{game_with_signal(R"({"name": "calm", "states": [{"name": "a", "above": 2, "below": 1}]})"),
              "game.signals[0].states[0].above is 2, more than below, which is 1; no value lies between them"},
        Wrong{
            game_with_signal(R"({"name": "calm"})",
                             R"({"name": "g", "conditions": [{"signal": {"name": "calm", "above": 1}}]})"),
            "game.levels[0].goals[0].conditions are satisfied by stale signals alone; set required of one of them, or "
            "add a condition about a body"},
        Wrong{R"({"levels": [{"name": "a", "repeats": true, "next": {"rows": [{"level": "a"}]}, "goals": [)" +
                  std::string(kGoal) + "]}]}",
              "game.levels[0].repeats is true, and the level has next, which alone determines the level that follows; "
              "remove repeats, and name this level in a row of next"},
        Wrong{game_with_table(R"({"rows": []})"), "game.levels[0].next.rows has 0 rows; it must have 1 to 16"},
        Wrong{
            game_with_table(R"({"rows": [{"score": "HIGH", "level": "a"}]})"),
            "game.levels[0].next.rows have no row without state for a low score; add one, which decides when no state "
            "is dominant"},
        Wrong{game_with_table(R"({"rows": [{"score": 7}]})"),
              "game.levels[0].next.rows[0].score is 7; it must be ANY, LOW or HIGH"},
        Wrong{game_with_table(R"({"rows": [{"level": "b"}]})"),
              "game.levels[0].next.rows[0].level is \"b\"; there is no level of that name"},
        Wrong{game_with_table(R"({"rows": [{"state": "sad"}]})"),
              "game.levels[0].next.rows[0].state is \"sad\", and the table has no signal; give signal, or no state"},
        Wrong{game_with_table(R"({"signal": "calm", "rows": [{"state": "sad"}]})"),
              "game.levels[0].next.rows[0].state is \"sad\"; it must be the name of a state of the signal calm"},
        Wrong{R"({"call": {"at_time_limit": true}, "levels": [{"name": "a", "goals": [)" + std::string(kGoal) + "]}]}",
              "game.call.at_time_limit is true, and game.time_limit_s is 0; give a time limit"},
        Wrong{
            R"({"levels": [{"name": "a", "solutions": [{"name": "s", "bodies": [{"body": "ball"}]}], "goals": [)" +
                std::string(kGoal) + "]}]}",
            "game.levels[0].solutions[0].bodies[0].body is \"ball\", which no silhouette of the level has as a piece"},
        Wrong{game_with_condition(R"({"in_region": {"body": "ball"}})"),
              kCondition + ".in_region.region has no kind; it must have one of sphere, box, cylinder"},
        Wrong{game_with_condition(R"({"in_region": {"body": "ball", "region": {"sphere": {"radius_m": -1}}}})"),
              kCondition + ".in_region.region.sphere.radius_m is -1 m; it must be from 1e-06 to 100 m"},
        Wrong{game_with_condition(
                  R"({"in_region": {"body": "ball", "region": {"body": "ball", "sphere": {"radius_m": 1}}}})"),
              kCondition +
                  ".in_region.region.body is \"ball\", the body of the condition itself; name another body, or "
                  "none"},
        Wrong{game_with_condition(R"({"at_pose": {"body": "ball", "angle_tolerance_deg": 200}})"),
              kCondition + ".at_pose.angle_tolerance_deg is 200 °; it must be from 0.1 to 180 °"},
        Wrong{game_with_condition(R"({"at_place": {"body": "ball"}})"),
              kCondition + ".at_place is not a field of a game; the fields are in proto/tandem/goals.proto"},
        Wrong{game_with_goal(R"({"name": "g", "at_least": 2, "conditions": [{"held": {"body": "ball"}}]})"),
              "game.levels[0].goals[0].at_least is 2, and the goal has 1 conditions; it must not be more"},
        Wrong{game_with_goal(R"({"name": "g", "score_per_s": 2, "conditions": [{"held": {"body": "ball"}}]})"),
              "game.levels[0].goals[0].score_per_s is 2; it needs a time_limit_s of the goal"},
        Wrong{game_with_goal(R"({"name": "g", "extra": true, "conditions": [{"held": {"body": "ball"}}]})"),
              "game.levels[0].goals are all extra; at least one must be needed, or the level ends at once"},
        Wrong{game_with_goal(std::string(kGoal) + "," + kGoal),
              "game.levels[0].goals[1].name is \"g\", which is taken; names must be unique"},
        Wrong{R"({"players": 3, "levels": [{"name": "a", "goals": [)" + std::string(kGoal) + "]}]}",
              "game.players is 3, and the scene has 2 tools; add tools, or lower it"},
        Wrong{R"({"levels": [{"name": "a", "bodies": ["cube"], "goals": [)" + std::string(kGoal) + "]}]}",
              "game.levels[0].bodies[0] is \"cube\"; there is no body of that name"},
        Wrong{
            R"({"levels": [{"name": "a", "parameters": [{"name": "coupling.force_limit_n", "value": 5000}], "goals": [)" +
                std::string(kGoal) + "]}]}",
            "game.levels[0].parameters[0].value is 5000; it must be from 0.001 to 1000"},
        Wrong{R"({"levels": [{"name": "a", "gravity_m_per_s2": [0, 1], "goals": [)" + std::string(kGoal) + "]}]}",
              "game.levels[0].gravity_m_per_s2 has 2 numbers; it must have 3 (x, y, z)"},
        Wrong{
            R"({"levels": [{"name": "a", "in_order": true, "goals": [{"name": "x", "extra": true,
                  "conditions": [{"held": {"body": "ball"}}]}, )" +
                std::string(kGoal) + "]}]}",
            "game.levels[0].goals[0].time_limit_s is 0; an extra goal of a level in order needs a time limit, or must "
            "be the last one"},
        Wrong{R"({"levels": [{"name": "a", "repeats": true, "time_limit_s": 0.5, "goals": [)" + std::string(kGoal) +
                  "]}]}",
              "game.levels[0].time_limit_s is 0.5 s; in a level that repeats it must be 0 (none), or 1 s or more"},
        Wrong{R"({"levels": [{"name": "a", "repeats": true, "goals": [{"name": "g", "time_limit_s": 0.001,
                  "conditions": [{"held": {"body": "ball"}}]}]}]})",
              "game.levels[0].goals[0].time_limit_s is 0.001 s; in a level that repeats it must be 0 (none), or 1 s or "
              "more"},
        Wrong{R"({"levels": [{"name": "a", "parameters": [{"name": "coupling.force_limit_n", "value": 5},
                  {"name": "coupling.force_limit_n", "value": 6}], "goals": [)" +
                  std::string(kGoal) + "]}]}",
              "game.levels[0].parameters[1].name is \"coupling.force_limit_n\", which is taken; names must be unique"},
        Wrong{
            game_with_condition(
                R"({"silhouette": {"pieces": [{"body": "ball", "points_m": [0, 0, 1, 0, 0, 1]}], "figure_m": [0, 0, 0, 1, 1, 0]}})"),
            kCondition + ".silhouette.figure_m crosses itself, or is clockwise; list its corners counterclockwise"},
        Wrong{
            game_with_condition(
                R"({"silhouette": {"pieces": [{"body": "ball", "points_m": [0, 0, 1]}], "figure_m": [0, 0, 1, 0, 1, 1]}})"),
            kCondition + ".silhouette.pieces[0].points_m has 3 numbers; it must have x and y of each corner"},
        Wrong{
            game_with_condition(
                R"({"silhouette": {"pieces": [{"body": "ball", "points_m": [0, 0, 2, 0, 1, 0.5, 2, 2]}], "figure_m": [0, 0, 1, 0, 1, 1]}})"),
            kCondition + ".silhouette.pieces[0].points_m is not convex and counterclockwise; divide the outline into "
                         "convex ones"}));

TEST(SceneGoals, MoreSilhouettesThanTheGameCanSearchAreRefused) {
  const auto game_with = [](int levels, int conditions) {
    const std::string one =
        R"({"silhouette": {"pieces": [{"body": "ball", "points_m": [0, 0, 1, 0, 0, 1]}], "figure_m": [0, 0, 1, 0, 0, 1]}})";
    std::string all = one;
    for (int i = 1; i < conditions; ++i) all += "," + one;
    std::string listed;
    for (int i = 0; i < levels; ++i) {
      listed += std::string(i > 0 ? "," : "") + R"({"name": "l)" + std::to_string(i) +
                R"(", "goals": [{"name": "g", "conditions": [)" + all + "]}]}";
    }
    return small_game(R"({"levels": [)" + listed + "]}");
  };
  EXPECT_NO_THROW(load_scene_text(game_with(2, 16), "game.json", "/"));
  try {
    load_scene_text(game_with(3, 11), "game.json", "/");
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    EXPECT_STREQ(error.what(), "game.json: game.levels has 33 silhouettes together; it must have 0 to 32");
  }
}

TEST(SceneGoals, ALawThatCannotReplaceThatOfTheSceneIsRefused) {
  const std::string game = R"({"levels": [{"name": "a", "law": "direct", "goals": [)" + std::string(kGoal) + "]}]}";
  try {
    load_scene_text(small_game(game), "game.json", "/");
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), ::testing::StartsWith("game.json: game.levels[0].law is \"direct\": "));
  }
}

TEST(SceneGoals, ACoefficientThatTheLawDeterminesIsRefused) {
  const auto load = [](const std::string& level) {
    std::string text = small_game(R"({"levels": [{"name": "a", "goals": [)" + std::string(kGoal) + "]" + level + "}]}");
    const std::string linear = physics::kLinear;
    text.replace(text.find(linear), linear.size(), physics::coupling_with("adaptive"));
    load_scene_text(text, "game.json", "/");
  };
  const std::string stiffness = R"(, "parameters": [{"name": "coupling.stiffness_n_per_m", "value": 200}])";
  EXPECT_NO_THROW(load(R"(, "law": "stable-dynamic")" + stiffness));
  try {
    load(stiffness);
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    EXPECT_STREQ(error.what(),
                 "game.json: game.levels[0].parameters[0].name is \"coupling.stiffness_n_per_m\", which the law "
                 "adaptive determines; remove it, or set another law of the level");
  }
}

TEST(SceneGoals, ABodyThatActsAtADistanceExistsInEveryLevel) {
  const std::string game =
      R"({"levels": [{"name": "a", "bodies": ["magnet"], "goals": [)" + std::string(kGoal) + "]}]}";
  const std::string magnet =
      R"(, {"name": "magnet", "shapes": [{"sphere": {"radius_m": 0.01}}], "effects": [{"magnet": {}}]})";
  try {
    load_scene_text(small_game(game, magnet), "game.json", "/");
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    EXPECT_STREQ(
        error.what(),
        "game.json: game.levels[0].bodies[0] is \"magnet\", which acts at a distance by effects or a molecule; "
        "such a body must exist in every level");
  }
}

TEST(SceneGoals, DefaultsAreFilledIn) {
  const auto scene = test::scene_of(small_game(game_with_condition(R"({"at_pose": {"body": "ball"}})")));
  const wire::Game& game = scene->description.game();
  EXPECT_EQ(game.title(), "s");
  EXPECT_EQ(game.players(), 1U);
  EXPECT_EQ(game.levels(0).text(), "a");
  EXPECT_EQ(game.levels(0).gravity_m_per_s2(2), -9.81);
  EXPECT_EQ(game.levels(0).goals(0).at_least(), 1U);
  EXPECT_EQ(game.levels(0).goals(0).score(), 1);
  EXPECT_EQ(game.levels(0).goals(0).conditions(0).at_pose().position_tolerance_m(), 0.005);
}

}  // namespace
}  // namespace tandem::server
