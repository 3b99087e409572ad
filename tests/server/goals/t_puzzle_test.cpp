// Tests the shipped scene `t_puzzle`: its figures, and hands that solve a figure.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/server/goals/game_room.hpp"

namespace tandem::server {
namespace {

constexpr double kWidth_m = 0.03;  ///< width of the bar of the T
constexpr double kTableToBoard_m = 0.025;

/// Place of a board in its figure, in units of the bar's width, from the centre of the figure.
struct Placed {
  const char* board;
  Vec3 p;
  double degrees;
};

BodyId body_named(const Room& room, const std::string& name) {
  const auto& bodies = room.scene().description.bodies();
  return body_id_at(static_cast<std::size_t>(std::ranges::find(bodies, name, &wire::Body::name) - bodies.begin()));
}

void place(GameRoom& game, const Placed& board, const Vec3& centre_m) {
  RoomCommand command{.kind = RoomCommand::Kind::kPlace};
  command.body = body_named(game.room, board.board);
  command.beside = body_named(game.room, "table");
  command.X_SB.p = centre_m + kWidth_m * board.p + Vec3(0, 0, kTableToBoard_m);
  command.X_SB.q = quaternion_of(Vec3(0, 0, board.degrees * std::numbers::pi / 180));
  game.command(command);
}

const std::vector<std::vector<Placed>> kSolutions{
    {{"triangle", {-2.0 / 3, -1.0 / 6, 0}, 90}, {"short", {2.0 / 9, 1.0 / 18, 0}, 0}},
    {{"pentagon", {1.0 / 9, 1.0 / 9, 0}, 0}, {"triangle", {-1.0 / 3, -1.0 / 3, 0}, -90}},
    {{"short", {11.0 / 9, 1.0 / 18, 0}, 0}, {"long", {-11.0 / 15, -1.0 / 30, 0}, -90}},
    {{"triangle", {-7.0 / 6, 7.0 / 6, 0}, 0},
     {"pentagon", {-7.0 / 18, 11.0 / 18, 0}, 0},
     {"short", {13.0 / 18, 19.0 / 18, 0}, 0},
     {"long", {1.0 / 30, -37.0 / 30, 0}, 0}}};

std::vector<GameEvent::Kind> reached(const GameRoom& game) {
  std::vector<GameEvent::Kind> kinds = game.kinds();
  std::erase_if(kinds, [](GameEvent::Kind kind) { return kind != GameEvent::Kind::kGoalReached; });
  return kinds;
}

TEST(TPuzzle, EachFigureIsReachedByItsSolutionAndNotBefore) {
  TANDEM_LOAD_SCENE(scene, "t_puzzle");
  for (std::size_t figure = 0; figure < kSolutions.size(); ++figure) {
    GameRoom game(scene);
    game.join(0);
    game.command({.kind = RoomCommand::Kind::kStartLevel, .level = static_cast<std::uint8_t>(figure)});
    game.run(1.5);
    EXPECT_TRUE(reached(game).empty()) << figure;
    const std::vector<Placed>& boards = kSolutions[figure];
    for (std::size_t i = 0; i + 1 < boards.size(); ++i) place(game, boards[i], Vec3::Zero());
    game.run(2);
    EXPECT_TRUE(reached(game).empty()) << figure;
    place(game, boards.back(), Vec3::Zero());
    game.run(2.5);
    EXPECT_EQ(reached(game).size(), 1U) << figure;
    EXPECT_EQ(game.status().total(), 10) << figure;
  }
}

TEST(TPuzzle, EachFigureHasASolutionToShowWhichReachesIt) {
  TANDEM_LOAD_SCENE(scene, "t_puzzle");
  const wire::Game& puzzle = scene->description.game();
  for (int figure = 0; figure < puzzle.levels_size(); ++figure) {
    ASSERT_EQ(puzzle.levels(figure).solutions_size(), 1) << figure;
    GameRoom game(scene);
    game.join(0);
    game.command({.kind = RoomCommand::Kind::kStartLevel, .level = static_cast<std::uint8_t>(figure)});
    for (const wire::SolvedBody& solved : puzzle.levels(figure).solutions(0).bodies()) {
      const Vec3 p(solved.position_m(0), solved.position_m(1), 0);
      place(game, {solved.body().c_str(), p / kWidth_m, solved.angle_deg()}, Vec3::Zero());
    }
    game.run(2.5);
    EXPECT_EQ(reached(game).size(), 1U) << figure;
  }
}

TEST(TPuzzle, ItsBoardsAreLightAndHaveTheAreaOfTheT) {
  TANDEM_LOAD_SCENE(scene, "t_puzzle");
  double area_m2 = 0;
  const wire::Silhouette& t = scene->description.game().levels(3).goals(0).conditions(0).silhouette();
  for (const wire::Outline& piece : t.pieces()) area_m2 += geometry::signed_area(polygon_of(piece.points_m()));
  EXPECT_NEAR(area_m2, 6 * kWidth_m * kWidth_m, 1e-6);
  EXPECT_NEAR(geometry::signed_area(polygon_of(t.figure_m())), area_m2, 1e-6);
  for (const wire::Body& body : scene->description.bodies()) EXPECT_LE(body.mass_kg(), 0.05) << body.name();
  EXPECT_EQ(scene->description.coupling().law(), "stable-dynamic");
}

/// Takes the board below the hand, carries it, and puts it down.
void carry(GameRoom& game, std::uint8_t hand, const Vec3& from, const Vec3& to) {
  constexpr double kAbove_m = 0.016, kCarried_m = 0.03;
  game.move(hand, from + Vec3(0, 0, kAbove_m));
  game.hands.at(hand).is_pressed = true;
  game.run(0.3);
  game.move(hand, from + Vec3(0, 0, kCarried_m));
  game.move(hand, to + Vec3(0, 0, kCarried_m));
  game.move(hand, to + Vec3(0, 0, kAbove_m));
  game.run(0.3);
  game.hands.at(hand).is_pressed = false;
  game.run(0.3);
  game.move(hand, to + Vec3(0, 0, 0.06));
}

TEST(TPuzzle, TwoHandsSolveTheJuniorFigure) {
  TANDEM_LOAD_SCENE(scene, "t_puzzle");
  GameRoom game(scene);
  game.join(0);
  game.join(1);
  game.run(0.1);
  const std::vector<Placed>& brick = kSolutions[0];
  carry(game, 0, {-0.09, 0.06, 0}, kWidth_m * brick[0].p);
  EXPECT_TRUE(reached(game).empty());
  carry(game, 1, {0.09, 0.06, 0}, kWidth_m * brick[1].p + Vec3(0.0005, 0, 0));
  game.run(2.5);
  EXPECT_EQ(reached(game).size(), 1U);
  EXPECT_EQ(game.status().level, 1);
}

}  // namespace
}  // namespace tandem::server
