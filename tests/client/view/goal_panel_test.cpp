// Tests the window's display of a game.
#include "client/view/goal_panel.hpp"

#include <gtest/gtest.h>
#include <imgui.h>

#include <memory>

namespace tandem::client {
namespace {

wire::Scene scene() {
  wire::Scene out;
  out.add_bodies()->set_name("ring");
  out.add_bodies()->set_name("ball");
  wire::Level& level = *out.mutable_game()->add_levels();
  level.set_time_limit_s(90);
  wire::Goal& goal = *level.add_goals();
  goal.set_text("ball\tin the ring");
  goal.set_time_limit_s(20);
  goal.set_at_least(2);
  wire::Region& region = *goal.add_conditions()->mutable_in_region()->mutable_region();
  region.set_body("ring");
  region.mutable_cylinder()->set_radius_m(0.03);
  region.mutable_cylinder()->set_length_m(0.02);
  goal.add_conditions()->mutable_held()->set_body("ball");
  wire::AtPose& pose = *level.add_goals()->add_conditions()->mutable_at_pose();
  pose.set_body("ball");
  for (const double number : {1, 2, 3}) pose.mutable_placement()->add_position_m(number);
  return out;
}

wire::GameState state() {
  wire::GameState out;
  out.set_phase(wire::GameState::PLAYING);
  out.set_level_elapsed_s(25.5);
  for (int i = 0; i < 2; ++i) out.add_goals()->set_status(wire::GoalState::OPEN);
  out.mutable_goals(0)->set_satisfied(1);
  out.mutable_goals(0)->set_elapsed_s(7.2);
  return out;
}

TEST(GoalPanel, RowsHaveConditionsAndTimeOfOpenGoals) {
  const std::vector<GoalRow> rows = goal_rows(scene().game(), state());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].text, "ball?in the ring  1/2  0:13 left");
  wire::GameState reached = state();
  reached.mutable_goals(0)->set_status(wire::GoalState::REACHED);
  EXPECT_EQ(goal_rows(scene().game(), reached)[0].text, "ball?in the ring");
  EXPECT_EQ(level_time_text(scene().game(), state()), "1:05 left");
}

TEST(GoalPanel, TimesAreRoundedUpToSeconds) {
  EXPECT_EQ(time_text(0), "0:00");
  EXPECT_EQ(time_text(0.1), "0:01");
  EXPECT_EQ(time_text(60), "1:00");
  EXPECT_EQ(time_text(3725), "62:05");
  EXPECT_EQ(time_text(-3), "0:00");
}

TEST(GoalPanel, RegionsAreOutlinedInTheFrameOfTheirBodyAndTargetsAreGhosts) {
  const auto pose_of = [](std::size_t body) { return Pose{{body == 0 ? 5.0 : 0.0, 0, 0}, Quat::Identity()}; };
  const GoalOutline outline = outline_of(scene(), state(), pose_of);
  ASSERT_FALSE(outline.lines.empty());
  for (const auto& [from, to] : outline.lines) {
    for (const Vec3& end : {from, to}) {
      EXPECT_NEAR((end - Vec3(5, 0, 0)).head<2>().norm(), 0.03, 1e-12);
      EXPECT_NEAR(std::abs(end.z()), 0.01, 1e-12);
    }
  }
  ASSERT_EQ(outline.ghosts.size(), 1U);
  EXPECT_EQ(outline.ghosts[0].first, 1U);
  EXPECT_EQ(outline.ghosts[0].second.p, Vec3(1, 2, 3));
}

TEST(GoalPanel, SignalsShowTheirStateOrThatTheGameRunsByScoreAlone) {
  wire::Game game;
  wire::GameSignal& signal = *game.add_signals();
  signal.set_text("valence");
  signal.add_states()->set_name("negative");
  wire::GameState now;
  now.add_signals();
  signal.set_name("emotion");
  EXPECT_EQ(signal_rows(game, now), std::vector<std::string>{"no signal valence"}) << "without a decision table";
  game.add_levels()->mutable_next()->set_signal("emotion");
  EXPECT_EQ(signal_rows(game, now), std::vector<std::string>{"no signal valence: by score alone"});
  now.mutable_signals(0)->set_fresh(true);
  now.mutable_signals(0)->set_value(-0.5);
  EXPECT_EQ(signal_rows(game, now), std::vector<std::string>{"valence: -0.50"});
  now.mutable_signals(0)->set_state(1);
  EXPECT_EQ(signal_rows(game, now), std::vector<std::string>{"valence: negative -0.50"});
}

TEST(GoalPanel, ASolutionHasTheOutlinesOfItsBodiesAtTheirPlaces) {
  wire::Level level;
  wire::Outline& piece = *level.add_goals()->add_conditions()->mutable_silhouette()->add_pieces();
  piece.set_body("board");
  for (const double number : {0, 0, 2, 0, 0, 1}) piece.add_points_m(number);
  wire::Solution solution;
  wire::SolvedBody& solved = *solution.add_bodies();
  solved.set_body("board");
  solved.set_angle_deg(90);
  EXPECT_TRUE(solution_outlines(level, solution).empty()) << "its place is absent";
  for (const double number : {10, 20}) solved.add_position_m(number);
  const auto outlines = solution_outlines(level, solution);
  ASSERT_EQ(outlines.size(), 1U);
  EXPECT_TRUE(outlines[0][1].isApprox(Eigen::Vector2d(10, 22)));
  EXPECT_TRUE(outlines[0][2].isApprox(Eigen::Vector2d(9, 20)));
}

/// Draws frames of the panel without a display, and clicks into them.
class PanelBench {
 public:
  explicit PanelBench(const wire::Scene& scene) {
    ImGui::SetCurrentContext(ImGui::CreateContext());
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::GetIO().DisplaySize = ImVec2(800, 600);
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
    auto joined = std::make_shared<wire::Joined>();
    *joined->mutable_scene() = scene;
    io_.joined = joined;
  }
  ~PanelBench() { ImGui::DestroyContext(); }
  PanelBench(const PanelBench&) = delete;
  PanelBench& operator=(const PanelBench&) = delete;

  /// Draws the panel of a level until its size is final. Returns the number of vertices of the last frame.
  int draw(std::uint32_t level) {
    wire::GameState state;
    state.set_level(level);
    io_.game = std::make_shared<const GameReport>(GameReport{state, {}});
    PanelContent content;
    content.io = &io_;
    for (int frame = 0; frame < 4; ++frame) {
      ImGui::GetIO().DeltaTime = 1.0F / 60;
      ImGui::NewFrame();
      draw_goals(content, 10);
      ImGui::Render();
    }
    return ImGui::GetDrawData()->TotalVtxCount;
  }
  void click(std::uint32_t level, float x, float y) {
    ImGui::GetIO().MousePos = ImVec2(x, y);
    draw(level);
    for (const bool is_down : {true, false}) {
      ImGui::GetIO().MouseDown[0] = is_down;
      draw(level);
    }
    ImGui::GetIO().MousePos = ImVec2(799, 599);
    draw(level);
  }

 private:
  ClientIoSnapshot io_;
};

wire::Scene scene_with_solutions() {
  wire::Scene out;
  for (int i = 0; i < 2; ++i) {
    wire::Level& level = *out.mutable_game()->add_levels();
    wire::Outline& piece = *level.add_goals()->add_conditions()->mutable_silhouette()->add_pieces();
    piece.set_body("board");
    for (const double number : {0, 0, 2, 0, 0, 1}) piece.add_points_m(number);
    wire::Solution& solution = *level.add_solutions();
    solution.set_name("s");
    wire::SolvedBody& solved = *solution.add_bodies();
    solved.set_body("board");
    for (const double number : {10, 20}) solved.add_position_m(number);
  }
  return out;
}

TEST(GoalPanel, AShownSolutionIsOfItsLevelOnly) {
  PanelBench bench(scene_with_solutions());
  const int first = bench.draw(0), second = bench.draw(1);
  for (float y = 12; y < 200 && bench.draw(0) <= first; y += 6) bench.click(0, 24, y);
  ASSERT_GT(bench.draw(0), first) << "the button of the solution was not found";
  EXPECT_EQ(bench.draw(1), second) << "the next level begins without a shown solution";
  EXPECT_GT(bench.draw(0), first);
}

TEST(GoalPanel, ReachedGoalsAndFinishedGamesShowNothing) {
  const auto pose_of = [](std::size_t) { return Pose{}; };
  wire::GameState other = state();
  for (int i = 0; i < 2; ++i) other.mutable_goals(i)->set_status(wire::GoalState::REACHED);
  EXPECT_TRUE(outline_of(scene(), other, pose_of).lines.empty());
  other = state();
  other.set_phase(wire::GameState::WON);
  EXPECT_TRUE(outline_of(scene(), other, pose_of).lines.empty());
}

}  // namespace
}  // namespace tandem::client
