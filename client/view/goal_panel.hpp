// The display of a game: a panel with level, goals, score, time and the last message, and lines that show the goals in
// the scene.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/view/panels.hpp"

namespace tandem::client {

/// A line about a goal for the user, and whether the goal is reached or failed.
struct GoalRow {
  std::string text;
  wire::GoalState::Status status = wire::GoalState::OPEN;
};

/// Returns the rows of the goals of the present level, with the time left and the conditions that hold.
std::vector<GoalRow> goal_rows(const wire::Game& game, const wire::GameState& state);
/// Returns a time as text, such as "1:05".
std::string time_text(double seconds);
/// Returns the time left, or the time passed if there is no limit.
std::string level_time_text(const wire::Game& game, const wire::GameState& state);

/// Returns one line of text for each signal of the game: its state and value, or a note that the game runs without this
/// signal.
std::vector<std::string> signal_rows(const wire::Game& game, const wire::GameState& state);

/// A closed polygon of a solution, in the frame of the figure [m].
using SolutionOutline = std::vector<Eigen::Vector2d>;
/// Returns the outlines of a solution's bodies at their target positions. Bodies without an outline in the level are
/// left out.
std::vector<SolutionOutline> solution_outlines(const wire::Level& level, const wire::Solution& solution);

using GoalLine = std::pair<Vec3, Vec3>;  ///< start and end of a line, in W
/// A body at its target pose in W. `body` is its index in the scene.
using GoalGhost = std::pair<std::size_t, Pose>;

struct GoalOutline {
  std::vector<GoalLine> lines;
  std::vector<GoalGhost> ghosts;
};

/// Returns the lines and ghosts that show the open goals:
/// * region: a box by its twelve edges, a sphere by three circles, a cylinder by its two ends and four edges
/// * figure: lines in the xy plane of the world
/// * target pose of a body: a ghost of the body
/// In      pose_of  function that returns the pose of the body with this index
GoalOutline outline_of(const wire::Scene& scene, const wire::GameState& state,
                       const std::function<Pose(std::size_t body)>& pose_of);

/// Draws the panel in the current ImGui context, at the left edge. Draws nothing in a room without a game.
///
/// In      top  upper edge of the panel [px]
/// Thread  the one that runs the window
void draw_goals(const PanelContent& content, float top);

/// Switches the gravity of a game on or off. Does nothing in a room without a game.
void set_game_gravity(ClientIo* client, bool is_on);

}  // namespace tandem::client
