// The game of a scene, prepared for evaluation in each step: names as indices, times as steps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "common/physics/coupling_in_force.hpp"
#include "server/assets/scene_file.hpp"
#include "server/assets/scene_goals.hpp"
#include "server/goals/conditions.hpp"
#include "server/goals/signals.hpp"
#include "server/goals/silhouette_fit.hpp"

namespace tandem::server {

struct PlannedCondition {
  GoalCondition condition;
  bool is_negated = false;
};

struct PlannedGoal {
  std::vector<PlannedCondition> conditions;
  std::size_t at_least = 1;
  std::uint64_t hold_steps = 0;
  std::uint64_t limit_steps = 0;  ///< 0: no time limit
  double score = 0;
  double score_per_step = 0;  ///< score for each step that remains until the limit when the goal is reached
  bool is_extra = false;      ///< true: the level can be reached without this goal
};

/// Decision table of a level: the first row that fits determines which level follows.
struct LevelTable {
  struct Row {
    enum class Score : std::uint8_t { kAny, kLow, kHigh };
    Score score = Score::kAny;
    std::optional<std::size_t> state{};  ///< dominant state of the signal; none: any
    std::optional<std::size_t> level{};  ///< index of the level that follows; none: the game is won
  };
  std::optional<std::size_t> signal{};  ///< index of the signal; none: rows are chosen by the score alone
  double high_score = 0;                ///< smallest level score that counts as high
  double dominant_share = 0.5;          ///< fraction of the level's time above which a state of the signal is dominant
  std::vector<Row> rows;

  /// Returns the index of the first row that fits score and state. The check of the scene ensures that there is one.
  /// In      dominant  dominant state of the signal; none: no state, or the signal was stale
  std::size_t row_for(double score, std::optional<std::size_t> dominant) const noexcept;
};

/// Limit of the time that a game may spend in one state of a signal.
struct PlannedStateLimit {
  std::size_t signal = 0;
  std::size_t state = 0;
  std::uint64_t steps = 0;
};

struct PlannedLevel {
  std::vector<PlannedGoal> goals;
  std::uint64_t limit_steps = 0;  ///< 0: no time limit
  std::uint64_t absent = 0;       ///< bit i: body i does not exist in this level
  Vec3 gravity_m_per_s2 = Vec3::Zero();
  const haptics::CouplingLawInfo* law = nullptr;
  haptics::CouplingParameters coupling;
  bool is_in_order = false;
  bool returns_bodies = false;
  bool repeats = false;
  std::optional<LevelTable> next;  ///< none: after this level is reached, the next level in the list follows
};

struct GamePlan {
  std::vector<PlannedLevel> levels;
  std::vector<SilhouettePlan> silhouettes;
  std::vector<std::size_t> bodies;  ///< bodies that a condition names
  std::uint64_t level_bodies = 0;   ///< bit i: body i exists only in the levels that name it
  std::uint64_t limit_steps = 0;    ///< 0: no time limit
  std::size_t players = 1;
  bool sets_coupling = false;  ///< true: at least one level sets a coupling law or a coefficient
  std::vector<PlannedSignal> signals;
  std::optional<PlannedStateLimit> state_limit;
  bool calls_at_time_limit = false;
  bool calls_at_state_limit = false;
};

/// Returns the game of a checked scene; none if the scene has no game.
std::optional<GamePlan> make_game_plan(const LoadedScene& scene);

/// Returns the index of a signal of a checked game.
std::size_t signal_index(const wire::Game& game, const std::string& name);

/// Returns the polygon of the numbers x, y, x, y, …
std::vector<Vec2> polygon_of(const google::protobuf::RepeatedField<double>& numbers);

/// Returns the coupling of a level: that of the scene, with the law and the coefficients of the level.
physics::SceneCoupling coupling_of_level(const LoadedScene& scene, std::size_t level);

/// Returns the balls that represent a body. They represent spheres, boxes and capsules exactly. A cylinder is replaced
/// by an enclosing prism with 16 sides, and a mesh by its bounding box.
std::vector<BodyBall> balls_of(const std::vector<SolidShape>& shapes);

}  // namespace tandem::server
