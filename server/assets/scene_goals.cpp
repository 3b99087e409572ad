#include "server/assets/scene_goals.hpp"

#include <algorithm>
#include <set>
#include <span>
#include <vector>

#include "common/geometry/polygon.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/physics/coupling_in_force.hpp"
#include "proto/coupling_fields.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/scene_coupling.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxFigureCorners = 32;
/// Shortest time limit of a level that repeats, so that its messages do not flood the users.
constexpr double kMinRepeat_s = 1;
constexpr std::size_t kMaxTitleBytes = 64, kMaxTextBytes = 200, kMaxSignalTextBytes = 64;

using geometry::Vec2;
using Numbers = google::protobuf::RepeatedField<double>;

void complete(wire::Condition& condition) {
  if (condition.has_in_region() && condition.in_region().has_region()) {
    condition.mutable_in_region()->mutable_region()->mutable_placement();
  }
  if (condition.has_at_pose()) condition.mutable_at_pose()->mutable_placement();
}

void complete(wire::Goal& goal) {
  for (wire::Condition& condition : *goal.mutable_conditions()) complete(condition);
  if (!goal.has_at_least()) goal.set_at_least(static_cast<std::uint32_t>(std::max(1, goal.conditions_size())));
  if (goal.text().empty()) goal.set_text(goal.name());
}

std::vector<Vec2> corners_of(const Numbers& numbers) {
  std::vector<Vec2> corners;
  for (int i = 0; i + 1 < numbers.size(); i += 2) corners.emplace_back(numbers[i], numbers[i + 1]);
  return corners;
}

/// Checks the limits `above` and `below` of a message.
template <class Message>
void check_interval(const Message& interval, const SceneField& field) {
  if (interval.above() <= interval.below()) return;
  field.in("above").refuse("is " + number_text(interval.above()) + ", more than below, which is " +
                           number_text(interval.below()) + "; no value lies between them");
}

class Checker {
 public:
  explicit Checker(const wire::Scene& scene) : scene_(scene) {}

  void game(const wire::Game& game, const SceneField& field) const {
    text(game.title(), kMaxTitleBytes, field.in("title"));
    say(game.won(), field.in("won"));
    say(game.lost(), field.in("lost"));
    signals(game, field);
    count(game.levels_size(), 1, kMaxLevels, "levels", field.in("levels"));
    std::set<std::string> names;
    for (int i = 0; i < game.levels_size(); ++i) {
      const SceneField of_level = field.in("levels", static_cast<std::size_t>(i));
      check_unique_name(game.levels(i).name(), names, of_level.in("name"));
      level(game.levels(i), of_level);
    }
    silhouettes(game, field.in("levels"));
    if (game.players() > static_cast<std::uint32_t>(scene_.tools_size())) {
      field.in("players").refuse("is " + std::to_string(game.players()) + ", and the scene has " +
                                 std::to_string(scene_.tools_size()) + " tools; add tools, or lower it");
    }
  }

 private:
  static void text(const std::string& value, std::size_t most, const SceneField& field) {
    if (value.size() <= most) return;
    field.refuse("has " + std::to_string(value.size()) + " bytes; it must have at most " + std::to_string(most));
  }
  static void say(const wire::Say& value, const SceneField& field) {
    text(value.text(), kMaxTextBytes, field.in("text"));
  }
  static void count(int number, int low, std::size_t high, const std::string& what, const SceneField& field) {
    if (number >= low && number <= static_cast<int>(high)) return;
    field.refuse("has " + std::to_string(number) + " " + what + "; it must have " + std::to_string(low) + " to " +
                 std::to_string(high));
  }
  void body(const std::string& name, const SceneField& field) const {
    const auto& bodies = scene_.bodies();
    if (name.empty()) field.refuse("is empty; name a body of the scene");
    if (std::ranges::find(bodies, name, &wire::Body::name) != bodies.end()) return;
    field.refuse("is \"" + name + "\"; there is no body of that name");
  }
  void frame(const std::string& name, const std::string& own, const SceneField& field) const {
    if (name.empty()) return;
    body(name, field);
    if (name == own) field.refuse("is \"" + name + "\", the body of the condition itself; name another body, or none");
  }

  /// Checks the signals of a game, the limit of the time in a state, and the rule for calling a person.
  void signals(const wire::Game& game, const SceneField& field) const {
    count(game.signals_size(), 0, kMaxSignals, "signals", field.in("signals"));
    std::set<std::string> names;
    for (int i = 0; i < game.signals_size(); ++i) {
      const SceneField of_signal = field.in("signals", static_cast<std::size_t>(i));
      signal(game.signals(i), of_signal);
      check_unique_name(game.signals(i).name(), names, of_signal.in("name"));
    }
    if (game.has_state_limit()) {
      const SceneField limit = field.in("state_limit");
      const wire::GameSignal& of_limit = named_signal(game.state_limit().signal(), limit.in("signal"));
      state(game.state_limit().state(), of_limit, limit.in("state"));
    }
    const SceneField call = field.in("call");
    say(game.call().said(), call.in("said"));
    if (game.call().at_time_limit() && game.time_limit_s() == 0) {
      call.in("at_time_limit").refuse("is true, and game.time_limit_s is 0; give a time limit");
    }
    if (game.call().at_state_limit() && !game.has_state_limit()) {
      call.in("at_state_limit").refuse("is true, and game.state_limit is absent; give one");
    }
  }
  static void signal(const wire::GameSignal& signal, const SceneField& field) {
    if (!proto::is_signal_name(signal.name())) {
      field.in("name").refuse("is \"" + signal.name() + "\"; it " + std::string(proto::kSignalNameRule));
    }
    text(signal.text(), kMaxSignalTextBytes, field.in("text"));
    count(signal.states_size(), 0, kMaxSignalStates, "states", field.in("states"));
    std::set<std::string> names;
    for (int i = 0; i < signal.states_size(); ++i) {
      const SceneField of_state = field.in("states", static_cast<std::size_t>(i));
      check_unique_name(signal.states(i).name(), names, of_state.in("name"));
      check_interval(signal.states(i), of_state);
    }
  }
  const wire::GameSignal& named_signal(const std::string& name, const SceneField& field) const {
    const auto& signals = scene_.game().signals();
    const auto found = std::ranges::find(signals, name, &wire::GameSignal::name);
    if (found == signals.end()) field.refuse("is \"" + name + "\"; it must be the name of one of game.signals");
    return *found;
  }
  static void state(const std::string& name, const wire::GameSignal& signal, const SceneField& field) {
    if (std::ranges::find(signal.states(), name, &wire::SignalState::name) != signal.states().end()) return;
    field.refuse("is \"" + name + "\"; it must be the name of a state of the signal " + signal.name());
  }
  void table(const wire::LevelTable& table, const SceneField& field) const {
    const wire::GameSignal* const signal =
        table.signal().empty() ? nullptr : &named_signal(table.signal(), field.in("signal"));
    count(table.rows_size(), 1, kMaxTableRows, "rows", field.in("rows"));
    bool has_low = false, has_high = false;
    for (int i = 0; i < table.rows_size(); ++i) {
      const wire::LevelChoice& row = table.rows(i);
      const SceneField of_row = field.in("rows", static_cast<std::size_t>(i));
      say(row.say(), of_row.in("say"));
      if (!wire::LevelChoice::Score_IsValid(row.score())) {
        of_row.in("score").refuse("is " + std::to_string(row.score()) + "; it must be ANY, LOW or HIGH");
      }
      if (!row.state().empty() && signal == nullptr) {
        of_row.in("state").refuse("is \"" + row.state() + "\", and the table has no signal; give signal, or no state");
      }
      if (!row.state().empty()) state(row.state(), *signal, of_row.in("state"));
      const auto& levels = scene_.game().levels();
      if (!row.level().empty() && std::ranges::find(levels, row.level(), &wire::Level::name) == levels.end()) {
        of_row.in("level").refuse("is \"" + row.level() + "\"; there is no level of that name");
      }
      has_low = has_low || (row.state().empty() && row.score() != wire::LevelChoice::HIGH);
      has_high = has_high || (row.state().empty() && row.score() != wire::LevelChoice::LOW);
    }
    if (has_low && has_high) return;
    field.in("rows").refuse(std::string("have no row without state for a ") + (has_low ? "high" : "low") +
                            " score; add one, which decides when no state is dominant");
  }
  void solutions(const wire::Level& level, const SceneField& field) const {
    count(level.solutions_size(), 0, kMaxSolutions, "solutions", field.in("solutions"));
    std::set<std::string> names;
    for (int i = 0; i < level.solutions_size(); ++i) {
      const SceneField of_solution = field.in("solutions", static_cast<std::size_t>(i));
      const wire::Solution& solution = level.solutions(i);
      check_unique_name(solution.name(), names, of_solution.in("name"));
      count(solution.bodies_size(), 1, kMaxPieces, "bodies", of_solution.in("bodies"));
      for (int j = 0; j < solution.bodies_size(); ++j) {
        const SceneField of_body = of_solution.in("bodies", static_cast<std::size_t>(j));
        solved(solution.bodies(j), level, of_body);
      }
    }
  }
  void solved(const wire::SolvedBody& solved, const wire::Level& level, const SceneField& field) const {
    body(solved.body(), field.in("body"));
    bool is_piece = false;
    for (const wire::Goal& goal : level.goals()) {
      for (const wire::Condition& condition : goal.conditions()) {
        is_piece = is_piece || std::ranges::find(condition.silhouette().pieces(), solved.body(),
                                                 &wire::Outline::body) != condition.silhouette().pieces().end();
      }
    }
    if (!is_piece) {
      field.in("body").refuse("is \"" + solved.body() + "\", which no silhouette of the level has as a piece");
    }
  }

  static void silhouettes(const wire::Game& game, const SceneField& field) {
    int number = 0;
    for (const wire::Level& level : game.levels()) {
      for (const wire::Goal& goal : level.goals()) {
        number += static_cast<int>(std::ranges::count_if(goal.conditions(), &wire::Condition::has_silhouette));
      }
    }
    count(number, 0, kMaxSilhouettes, "silhouettes together", field);
  }

  void level(const wire::Level& level, const SceneField& field) const {
    text(level.text(), kMaxTextBytes, field.in("text"));
    say(level.started(), field.in("started"));
    say(level.reached(), field.in("reached"));
    say(level.failed(), field.in("failed"));
    count(level.goals_size(), 1, kMaxGoalsPerLevel, "goals", field.in("goals"));
    std::set<std::string> names;
    for (int i = 0; i < level.goals_size(); ++i) {
      const SceneField of_goal = field.in("goals", static_cast<std::size_t>(i));
      check_unique_name(level.goals(i).name(), names, of_goal.in("name"));
      goal(level.goals(i), of_goal);
    }
    if (std::ranges::all_of(level.goals(), [](const wire::Goal& goal) { return goal.extra(); })) {
      field.in("goals").refuse("are all extra; at least one must be needed, or the level ends at once");
    }
    time_limits(level, field);
    if (level.has_next() && level.repeats()) {
      field.in("repeats").refuse(
          "is true, and the level has next, which alone determines the level that follows; remove repeats, and name "
          "this "
          "level in a row of next");
    }
    if (level.has_next()) table(level.next(), field.in("next"));
    solutions(level, field);
    level_bodies(level, field);
    coupling(level, field);
  }
  static void time_limits(const wire::Level& level, const SceneField& field) {
    // A level with `next` may follow itself. Its time limit therefore has the same bounds as that of a repeating level.
    const bool repeats = level.repeats() || level.has_next();
    if (repeats) repeat_limit(level.time_limit_s(), field.in("time_limit_s"));
    for (int i = 0; i < level.goals_size(); ++i) {
      const wire::Goal& goal = level.goals(i);
      const SceneField limit = field.in("goals", static_cast<std::size_t>(i)).in("time_limit_s");
      if (repeats && !goal.extra()) repeat_limit(goal.time_limit_s(), limit);
      if (level.in_order() && goal.extra() && goal.time_limit_s() == 0 && i + 1 < level.goals_size()) {
        limit.refuse("is 0; an extra goal of a level in order needs a time limit, or must be the last one");
      }
    }
  }
  static void repeat_limit(double limit_s, const SceneField& field) {
    if (limit_s <= 0 || limit_s >= kMinRepeat_s) return;
    field.refuse("is " + number_text(limit_s) + " s; in a level that repeats it must be 0 (none), or " +
                 number_text(kMinRepeat_s) + " s or more");
  }
  void level_bodies(const wire::Level& level, const SceneField& field) const {
    for (int i = 0; i < level.bodies_size(); ++i) {
      const SceneField of_body = field.in("bodies", static_cast<std::size_t>(i));
      body(level.bodies(i), of_body);
      const wire::Body& named = *std::ranges::find(scene_.bodies(), level.bodies(i), &wire::Body::name);
      const auto is_molecule = [](const wire::Shape& shape) { return shape.has_molecule(); };
      if (!named.effects().empty() || std::ranges::any_of(named.shapes(), is_molecule)) {
        of_body.refuse("is \"" + level.bodies(i) +
                       "\", which acts at a distance by effects or a molecule; such a body must exist in every level");
      }
      const auto holder = std::ranges::find(scene_.tools(), level.bodies(i), &wire::Tool::holds);
      if (holder == scene_.tools().end()) continue;
      of_body.refuse("is \"" + level.bodies(i) + "\", which tool " + holder->name() +
                     " holds from the start; such a body must exist in every level");
    }
  }
  void coupling(const wire::Level& level, const SceneField& field) const {
    const haptics::CouplingLawInfo* const of_scene = haptics::find_coupling_law(scene_.coupling().law());
    if (!level.law().empty()) {
      const haptics::CouplingLawInfo* const law = haptics::find_coupling_law(level.law());
      if (law == nullptr) {
        field.in("law").refuse("is \"" + level.law() + "\"; it must be one of " + haptics::listed_coupling_law_names());
      }
      const std::string problem = haptics::law_change_problem(*of_scene, *law, scene_.coupling().has_adaptive());
      if (!problem.empty()) field.in("law").refuse("is \"" + level.law() + "\": " + problem);
    }
    const haptics::CouplingLawInfo& in_force =
        level.law().empty() ? *of_scene : *haptics::find_coupling_law(level.law());
    physics::SceneCoupling chosen;
    chosen.law = in_force.name;
    chosen.fit = adaptive_fit(scene_.coupling());
    std::set<std::string> names;
    for (int i = 0; i < level.parameters_size(); ++i) {
      const wire::LevelParameter& parameter = level.parameters(i);
      const SceneField of_parameter = field.in("parameters", static_cast<std::size_t>(i));
      const proto::CouplingField* const known = proto::find_coupling_field(parameter.name());
      if (known == nullptr) {
        std::string listed;
        for (const proto::CouplingField& one : proto::kCouplingFields) {
          listed += (listed.empty() ? "" : ", ") + std::string(one.name);
        }
        of_parameter.in("name").refuse("is \"" + parameter.name() + "\"; it must be one of " + listed);
      }
      check_unique_name(parameter.name(), names, of_parameter.in("name"));
      if (physics::is_chosen_by_law(chosen, known->value)) {
        of_parameter.in("name").refuse("is \"" + parameter.name() + "\", which the law " + std::string(in_force.name) +
                                       " determines; remove it, or set another law of the level");
      }
      of_parameter.in("value").require_within(parameter.value(), known->low, known->high,
                                              "from " + number_text(known->low) + " to " + number_text(known->high));
    }
  }

  void goal(const wire::Goal& goal, const SceneField& field) const {
    text(goal.text(), kMaxTextBytes, field.in("text"));
    say(goal.reached(), field.in("reached"));
    say(goal.failed(), field.in("failed"));
    count(goal.conditions_size(), 1, kMaxConditionsPerGoal, "conditions", field.in("conditions"));
    if (goal.at_least() > static_cast<std::uint32_t>(goal.conditions_size())) {
      field.in("at_least")
          .refuse("is " + std::to_string(goal.at_least()) + ", and the goal has " +
                  std::to_string(goal.conditions_size()) + " conditions; it must not be more");
    }
    if (goal.score_per_s() > 0 && goal.time_limit_s() == 0) {
      field.in("score_per_s").refuse("is " + number_text(goal.score_per_s()) + "; it needs a time_limit_s of the goal");
    }
    for (int i = 0; i < goal.conditions_size(); ++i) {
      condition(goal.conditions(i), field.in("conditions", static_cast<std::size_t>(i)));
    }
    const auto is_optional_signal = [](const wire::Condition& condition) {
      return condition.has_signal() && !condition.signal().required();
    };
    if (std::ranges::count_if(goal.conditions(), is_optional_signal) < static_cast<std::ptrdiff_t>(goal.at_least()))
      return;
    field.in("conditions")
        .refuse("are satisfied by stale signals alone; set required of one of them, or add a condition about a body");
  }
  void condition(const wire::Condition& condition, const SceneField& field) const {
    switch (condition.kind_case()) {
      case wire::Condition::kInRegion:
        return in_region(condition.in_region(), field.in("in_region"));
      case wire::Condition::kAtPose:
        body(condition.at_pose().body(), field.in("at_pose").in("body"));
        return frame(condition.at_pose().beside(), condition.at_pose().body(), field.in("at_pose").in("beside"));
      case wire::Condition::kHeld:
        return held(condition.held(), field.in("held"));
      case wire::Condition::kSlower:
        return body(condition.slower().body(), field.in("slower").in("body"));
      case wire::Condition::kSilhouette:
        return silhouette(condition.silhouette(), field.in("silhouette"));
      case wire::Condition::kSignal:
        named_signal(condition.signal().name(), field.in("signal").in("name"));
        return check_interval(condition.signal(), field.in("signal"));
      case wire::Condition::KIND_NOT_SET:
        field.refuse("has no kind; it must have one of in_region, at_pose, held, slower, silhouette, signal");
    }
  }
  void in_region(const wire::InRegion& condition, const SceneField& field) const {
    body(condition.body(), field.in("body"));
    if (!condition.has_region() || condition.region().kind_case() == wire::Region::KIND_NOT_SET) {
      field.in("region").refuse("has no kind; it must have one of sphere, box, cylinder");
    }
    frame(condition.region().body(), condition.body(), field.in("region").in("body"));
  }
  void held(const wire::Held& condition, const SceneField& field) const {
    body(condition.body(), field.in("body"));
    const auto found = std::ranges::find(scene_.bodies(), condition.body(), &wire::Body::name);
    if (!found->graspable()) {
      field.in("body").refuse("is \"" + condition.body() + "\", which is not graspable; set graspable of that body");
    }
  }
  void silhouette(const wire::Silhouette& condition, const SceneField& field) const {
    count(condition.pieces_size(), 1, kMaxPieces, "pieces", field.in("pieces"));
    for (int i = 0; i < condition.pieces_size(); ++i) {
      const SceneField piece = field.in("pieces", static_cast<std::size_t>(i));
      body(condition.pieces(i).body(), piece.in("body"));
      const std::vector<Vec2> outline =
          corners(condition.pieces(i).points_m(), geometry::kMaxConvexCorners, piece.in("points_m"));
      if (!geometry::is_convex(outline)) {
        piece.in("points_m").refuse("is not convex and counterclockwise; divide the outline into convex ones");
      }
    }
    const std::vector<Vec2> figure = corners(condition.figure_m(), kMaxFigureCorners, field.in("figure_m"));
    if (geometry::signed_area(figure) <= 0 || geometry::triangulate(figure).empty()) {
      field.in("figure_m").refuse("crosses itself, or is clockwise; list its corners counterclockwise");
    }
  }
  static std::vector<Vec2> corners(const Numbers& numbers, std::size_t most, const SceneField& field) {
    if (numbers.size() % 2 != 0) {
      field.refuse("has " + std::to_string(numbers.size()) + " numbers; it must have x and y of each corner");
    }
    count(numbers.size() / 2, 3, most, "corners", field);
    return corners_of(numbers);
  }

  const wire::Scene& scene_;
};

}  // namespace

void complete_goals(wire::Scene& scene) {
  if (!scene.has_game()) return;
  wire::Game& game = *scene.mutable_game();
  if (game.title().empty()) game.set_title(scene.name());
  for (wire::GameSignal& signal : *game.mutable_signals()) {
    if (signal.text().empty()) signal.set_text(signal.name());
  }
  for (wire::Level& level : *game.mutable_levels()) {
    if (level.text().empty()) level.set_text(level.name());
    for (wire::Goal& goal : *level.mutable_goals()) complete(goal);
    if (!level.gravity_m_per_s2().empty()) continue;
    if (scene.gravity_m_per_s2().empty()) {
      for (const double number : proto::scene_range("Scene.gravity_m_per_s2").fallback)
        level.add_gravity_m_per_s2(number);
    } else {
      *level.mutable_gravity_m_per_s2() = scene.gravity_m_per_s2();
    }
  }
}

void check_goals(const wire::Scene& scene, const SceneField& file) {
  if (scene.has_game()) Checker(scene).game(scene.game(), file.in("game"));
}

std::string unknown_goal_field_remedy(const std::string& field) {
  if (field.rfind("game", 0) != 0) return {};
  return "is not a field of a game; the fields are in proto/tandem/goals.proto";
}

}  // namespace tandem::server
