#include "server/goals/game_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "proto/coupling_fields.hpp"
#include "proto/placement.hpp"

namespace tandem::server {
namespace {

constexpr int kCylinderSides = 16;
constexpr double kDegree = std::numbers::pi / 180;

/// Adds the eight corners of a box with the half edges `half_m`.
void add_corners(const Pose& X_BS, const Vec3& centre_S, const Vec3& half_m, std::vector<BodyBall>& out) {
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1);
    out.push_back({X_BS * Vec3(centre_S + half_m.cwiseProduct(sign)), 0});
  }
}

void add_cylinder(const Pose& X_BS, const wire::Cylinder& cylinder, std::vector<BodyBall>& out) {
  const double radius_m = cylinder.radius_m() / std::cos(std::numbers::pi / kCylinderSides);
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCylinderSides;
    for (const double z : {-cylinder.length_m() / 2, cylinder.length_m() / 2}) {
      out.push_back({X_BS * Vec3(radius_m * std::cos(angle), radius_m * std::sin(angle), z), 0});
    }
  }
}

void add_mesh(const Pose& X_BS, const geometry::TriangleMesh& mesh, std::vector<BodyBall>& out) {
  if (mesh.vertices.empty()) return;
  Vec3 low = mesh.vertices.front(), high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  add_corners(X_BS, (low + high) / 2, (high - low) / 2, out);
}

void add_shape(const SolidShape& solid, std::vector<BodyBall>& out) {
  const wire::Shape& shape = solid.shape;
  const Pose X_BS = proto::pose_from_placement(shape.placement());
  if (shape.has_sphere()) {
    out.push_back({X_BS.p, shape.sphere().radius_m()});
  } else if (shape.has_box()) {
    const auto& size = shape.box().size_m();
    add_corners(X_BS, Vec3::Zero(), Vec3(size[0], size[1], size[2]) / 2, out);
  } else if (shape.has_cylinder()) {
    add_cylinder(X_BS, shape.cylinder(), out);
  } else if (shape.has_capsule()) {
    for (const double z : {-shape.capsule().length_m() / 2, shape.capsule().length_m() / 2}) {
      out.push_back({X_BS * Vec3(0, 0, z), shape.capsule().radius_m()});
    }
  } else if (solid.mesh != nullptr) {
    add_mesh(X_BS, *solid.mesh, out);
  }
}

/// Makes the plan of one game. All names were checked when the scene was loaded.
class Planner {
 public:
  explicit Planner(const LoadedScene& scene) : scene_(scene) {}

  GamePlan plan() {
    const wire::Game& game = scene_.description.game();
    GamePlan plan;
    plan.players = game.players();
    plan.limit_steps = steps(game.time_limit_s());
    plan.level_bodies = level_bodies(game);
    for (const wire::GameSignal& signal : game.signals()) plan.signals.push_back(planned(signal));
    if (game.has_state_limit()) plan.state_limit = planned(game.state_limit());
    plan.calls_at_time_limit = game.call().at_time_limit();
    plan.calls_at_state_limit = game.call().at_state_limit();
    for (int i = 0; i < game.levels_size(); ++i) {
      plan.levels.push_back(level(game.levels(i), static_cast<std::size_t>(i), plan.level_bodies));
      plan.sets_coupling = plan.sets_coupling || !game.levels(i).law().empty() || game.levels(i).parameters_size() > 0;
    }
    std::ranges::sort(named_);
    named_.erase(std::unique(named_.begin(), named_.end()), named_.end());
    plan.bodies = named_;
    plan.silhouettes = silhouettes_;
    return plan;
  }

 private:
  /// Converts a time to the nearest number of steps. The result is at least 1 for a time above 0.
  std::uint64_t steps(double seconds) const {
    if (seconds <= 0) return 0;
    return static_cast<std::uint64_t>(std::max(1.0, std::round(seconds * scene_.description.step_rate_hz())));
  }
  std::size_t index(const std::string& name) const {
    const auto& bodies = scene_.description.bodies();
    return static_cast<std::size_t>(std::ranges::find(bodies, name, &wire::Body::name) - bodies.begin());
  }
  std::size_t body(const std::string& name) {
    named_.push_back(index(name));
    return named_.back();
  }
  std::optional<std::size_t> frame(const std::string& name) {
    return name.empty() ? std::nullopt : std::optional(body(name));
  }
  std::uint64_t set_of(const wire::Level& level) const {
    std::uint64_t bits = 0;
    for (const std::string& name : level.bodies()) bits |= std::uint64_t{1} << index(name);
    return bits;
  }
  std::uint64_t level_bodies(const wire::Game& game) const {
    std::uint64_t bits = 0;
    for (const wire::Level& level : game.levels()) bits |= set_of(level);
    return bits;
  }

  PlannedLevel level(const wire::Level& from, std::size_t number, std::uint64_t of_levels) {
    PlannedLevel to;
    for (const wire::Goal& goal : from.goals()) to.goals.push_back(planned(goal));
    to.limit_steps = steps(from.time_limit_s());
    to.absent = of_levels & ~set_of(from);
    const auto& gravity = from.gravity_m_per_s2();
    to.gravity_m_per_s2 = {gravity[0], gravity[1], gravity[2]};
    const physics::SceneCoupling coupling = coupling_of_level(scene_, number);
    to.law = haptics::find_coupling_law(coupling.law);
    to.coupling = coupling.parameters;
    to.is_in_order = from.in_order();
    to.returns_bodies = from.returns_bodies();
    to.repeats = from.repeats();
    if (from.has_next()) to.next = planned(from.next());
    return to;
  }
  const wire::Game& game() const { return scene_.description.game(); }
  /// Returns the interval of a message with the fields `above` and `below`.
  template <class Message>
  static SignalRange range_of(const Message& from) {
    return {from.above(), from.below()};
  }
  PlannedSignal planned(const wire::GameSignal& from) const {
    PlannedSignal to{steps(from.max_age_s()), from.min_confidence(), {}};
    for (const wire::SignalState& state : from.states()) to.states.push_back(range_of(state));
    return to;
  }
  std::size_t state_index(std::size_t signal, const std::string& name) const {
    const auto& states = game().signals(static_cast<int>(signal)).states();
    return static_cast<std::size_t>(std::ranges::find(states, name, &wire::SignalState::name) - states.begin());
  }
  PlannedStateLimit planned(const wire::StateLimit& from) const {
    const std::size_t signal = signal_index(game(), from.signal());
    return {signal, state_index(signal, from.state()), steps(from.limit_s())};
  }
  LevelTable planned(const wire::LevelTable& from) const {
    LevelTable to;
    if (!from.signal().empty()) to.signal = signal_index(game(), from.signal());
    to.high_score = from.high_score();
    to.dominant_share = from.dominant_percent() / 100;
    for (const wire::LevelChoice& row : from.rows()) {
      LevelTable::Row planned{static_cast<LevelTable::Row::Score>(row.score())};
      if (!row.state().empty()) planned.state = state_index(*to.signal, row.state());
      if (!row.level().empty()) {
        const auto& levels = game().levels();
        planned.level =
            static_cast<std::size_t>(std::ranges::find(levels, row.level(), &wire::Level::name) - levels.begin());
      }
      to.rows.push_back(planned);
    }
    return to;
  }
  PlannedGoal planned(const wire::Goal& from) {
    PlannedGoal to;
    for (const wire::Condition& condition : from.conditions()) {
      to.conditions.push_back({planned(condition), condition.negated()});
    }
    to.at_least = from.at_least();
    to.hold_steps = steps(from.hold_s());
    to.limit_steps = steps(from.time_limit_s());
    to.score = from.score();
    to.score_per_step = from.score_per_s() / scene_.description.step_rate_hz();
    to.is_extra = from.extra();
    return to;
  }
  GoalCondition planned(const wire::Condition& from) {
    switch (from.kind_case()) {
      case wire::Condition::kInRegion:
        return planned(from.in_region());
      case wire::Condition::kAtPose:
        return AtPoseCondition{body(from.at_pose().body()), frame(from.at_pose().beside()),
                               proto::pose_from_placement(from.at_pose().placement()),
                               from.at_pose().position_tolerance_m(), from.at_pose().angle_tolerance_deg() * kDegree};
      case wire::Condition::kHeld:
        return HeldCondition{body(from.held().body()), from.held().hands()};
      case wire::Condition::kSilhouette:
        silhouettes_.push_back(planned(from.silhouette()));
        return SilhouetteCondition{silhouettes_.size() - 1};
      case wire::Condition::kSignal:
        return SignalCondition{signal_index(game(), from.signal().name()), range_of(from.signal()),
                               from.signal().required()};
      default:
        return SlowerCondition{body(from.slower().body()), from.slower().speed_m_per_s(),
                               from.slower().turn_deg_per_s() * kDegree};
    }
  }
  InRegionCondition planned(const wire::InRegion& from) {
    InRegionCondition to;
    to.body = body(from.body());
    to.balls = from.whole() ? balls_of(scene_.body_shapes[to.body]) : std::vector<BodyBall>{};
    // A body without solid shapes is represented by its origin, even if the whole body is required to be inside.
    if (to.balls.empty()) to.balls.push_back({Vec3::Zero(), 0});
    to.region.body = frame(from.region().body());
    to.region.X_FR = proto::pose_from_placement(from.region().placement());
    if (from.region().has_sphere()) {
      to.region.kind = GoalRegion::Kind::kSphere;
      to.region.half_m.x() = from.region().sphere().radius_m();
    } else if (from.region().has_cylinder()) {
      const wire::Cylinder& cylinder = from.region().cylinder();
      to.region.kind = GoalRegion::Kind::kCylinder;
      to.region.half_m = {cylinder.radius_m(), 0, cylinder.length_m() / 2};
    } else {
      const auto& size = from.region().box().size_m();
      to.region.half_m = Vec3(size[0], size[1], size[2]) / 2;
    }
    return to;
  }

  SilhouettePlan planned(const wire::Silhouette& from) {
    SilhouettePlan to;
    for (const wire::Outline& piece : from.pieces()) {
      to.pieces.push_back({body(piece.body()), polygon_of(piece.points_m())});
    }
    const std::vector<Vec2> figure = polygon_of(from.figure_m());
    to.figure = geometry::triangulate(figure);
    to.figure_area_m2 = geometry::signed_area(figure);
    to.figure_centre = geometry::centroid(figure);
    to.covered = from.covered_percent() / 100;
    to.outside = from.outside_percent() / 100;
    return to;
  }

  const LoadedScene& scene_;
  std::vector<std::size_t> named_;
  std::vector<SilhouettePlan> silhouettes_;
};

}  // namespace

std::size_t LevelTable::row_for(double score, std::optional<std::size_t> dominant) const noexcept {
  const Row::Score of_level = score >= high_score ? Row::Score::kHigh : Row::Score::kLow;
  const auto fits = [&](const Row& row) {
    return (row.score == Row::Score::kAny || row.score == of_level) && (!row.state || row.state == dominant);
  };
  return static_cast<std::size_t>(std::ranges::find_if(rows, fits) - rows.begin());
}

std::size_t signal_index(const wire::Game& game, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(game.signals(), name, &wire::GameSignal::name) -
                                  game.signals().begin());
}

std::vector<Vec2> polygon_of(const google::protobuf::RepeatedField<double>& numbers) {
  std::vector<Vec2> polygon;
  for (int i = 0; i + 1 < numbers.size(); i += 2) polygon.emplace_back(numbers[i], numbers[i + 1]);
  return polygon;
}

std::vector<BodyBall> balls_of(const std::vector<SolidShape>& shapes) {
  std::vector<BodyBall> balls;
  for (const SolidShape& shape : shapes) add_shape(shape, balls);
  if (balls.size() <= kMaxBodyBalls) return balls;
  Vec3 low = balls.front().p_B, high = low;
  for (const BodyBall& ball : balls) {
    low = low.cwiseMin(ball.p_B - Vec3::Constant(ball.radius_m));
    high = high.cwiseMax(ball.p_B + Vec3::Constant(ball.radius_m));
  }
  balls.clear();
  add_corners(Pose{}, (low + high) / 2, (high - low) / 2, balls);
  return balls;
}

physics::SceneCoupling coupling_of_level(const LoadedScene& scene, std::size_t level) {
  physics::SceneCoupling coupling = scene.world.coupling;
  const wire::Level& from = scene.description.game().levels(static_cast<int>(level));
  if (const auto* law = haptics::find_coupling_law(from.law()); law != nullptr) coupling.law = law->name;
  for (const wire::LevelParameter& parameter : from.parameters()) {
    const proto::CouplingField* const field = proto::find_coupling_field(parameter.name());
    if (field != nullptr) coupling.parameters.*field->value = parameter.value();
  }
  return coupling;
}

std::optional<GamePlan> make_game_plan(const LoadedScene& scene) {
  if (!scene.description.has_game()) return std::nullopt;
  return Planner(scene).plan();
}

}  // namespace tandem::server
