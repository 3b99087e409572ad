#include "server/goals/game.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace tandem::server {
namespace {

/// Minimum distance between the bounding spheres of a hand and of a body for the body to appear. A static body
/// disappears only at this distance, too. A shorter distance could cause a jump of force.
constexpr double kClearance_m = 0.005;
constexpr std::uint64_t kHashStart = 0xcbf29ce484222325U;
constexpr std::uint64_t kPublishedPerSecond = 10;
/// Shortest time of a level with a decision table. Such a level can be followed by itself, and the messages of its ends
/// must not flood users.
constexpr double kMinRound_s = 1;

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) noexcept {
  return (hash ^ word) * 0x100000001b3U;
}

std::uint64_t bit(std::size_t body) noexcept {
  return std::uint64_t{1} << body;
}

}  // namespace

Game::Game(const LoadedScene& scene, GamePlan plan) : scene_(scene), plan_(std::move(plan)) {
  min_round_steps_ = static_cast<std::uint64_t>(std::ceil(kMinRound_s * scene_.description.step_rate_hz()));
  for (const SilhouettePlan& silhouette : plan_.silhouettes) fits_.emplace_back(silhouette);
  for (std::size_t i = 0; i < std::min(tool_radius_m_.size(), scene_.world.tools.size()); ++i) {
    tool_radius_m_[i] = scene_.world.tools[i].touch.radius_m;
  }
  for (std::size_t i = 0; i < scene_.world.bodies.size(); ++i) returnable_ |= bit(i);
  for (const physics::ToolDescription& tool : scene_.world.tools) {
    if (tool.holds_body) returnable_ &= ~bit(*tool.holds_body);
  }
}

void Game::restart(physics::World& world, std::uint32_t hands) noexcept {
  const GameStatus before = std::exchange(status_, GameStatus{});
  status_.entries = before.entries;
  status_.step = before.step;
  status_.events_hash = kHashStart;
  status_.signals = before.signals;
  status_.signals.resize(plan_.signals.size());
  for (SignalStatus& signal : status_.signals) signal.level_steps = signal.steps = {};
  read_absent(world);
  enter(0, world, hands);
  exchange_bodies(world, hands);
  publish();
}

bool Game::resume(const GameStatus& status, physics::World& world) noexcept {
  if (status.level >= plan_.levels.size() || status.goals.size() != plan_.levels[status.level].goals.size())
    return false;
  const bool is_finite = std::isfinite(status.score) && std::isfinite(status.level_score);
  if (!is_finite || status.signals.size() > plan_.signals.size()) return false;
  const std::uint32_t entries = status_.entries;
  status_ = status;
  status_.entries = entries;
  status_.signals.resize(plan_.signals.size());
  for (SignalStatus& signal : status_.signals) signal.has_value = false;
  read_absent(world);
  apply_level(world);
  exchange_bodies(world, 0);
  publish();
  return true;
}

void Game::start_level(std::size_t level, physics::World& world, std::uint32_t hands) noexcept {
  if (level >= plan_.levels.size()) return;
  if (status_.phase == GamePhase::kWon || status_.phase == GamePhase::kLost) {
    status_.score = status_.level_score = 0;
    status_.steps = 0;
    status_.has_called = false;
    for (SignalStatus& signal : status_.signals) signal.steps = {};
  }
  if (status_.phase != GamePhase::kWaiting) status_.phase = GamePhase::kPlaying;
  enter(level, world, hands);
}

void Game::set_weightless(bool is_weightless, physics::World& world) noexcept {
  status_.is_weightless = is_weightless;
  world.set_gravity(is_weightless ? Vec3(Vec3::Zero()) : level().gravity_m_per_s2);
}

void Game::set_signal(std::size_t number, const SignalValue& value) noexcept {
  if (number >= status_.signals.size() || !std::isfinite(value.value) || !std::isfinite(value.confidence)) return;
  SignalStatus& signal = status_.signals[number];
  signal.has_value = true;
  signal.value = value.value;
  signal.confidence = value.confidence;
  signal.age_steps = value.age_steps;
}

void Game::forget_signals() noexcept {
  for (SignalStatus& signal : status_.signals) {
    signal.has_value = false;
    signal.value = signal.confidence = 0;
    signal.age_steps = 0;
  }
}

/// Starts a level. The score of an unfinished attempt at the level is lost.
void Game::enter(std::size_t number, physics::World& world, std::uint32_t hands) noexcept {
  status_.level = static_cast<std::uint8_t>(number);
  status_.level_score = 0;
  status_.level_steps = 0;
  for (SignalStatus& signal : status_.signals) signal.level_steps = {};
  status_.goals.clear();
  for (std::size_t i = 0; i < level().goals.size(); ++i) {
    const bool is_open = i == 0 || !level().is_in_order;
    status_.goals.push_back({.status = is_open ? GoalStatus::kOpen : GoalStatus::kWaiting});
  }
  for (SilhouetteFit& fit : fits_) fit.reset();
  apply_level(world);
  if (level().returns_bodies) return_bodies(world, hands);
  if (status_.phase == GamePhase::kPlaying) emit(GameEvent::Kind::kLevelStarted);
}

void Game::read_absent(const physics::World& world) noexcept {
  status_.absent = 0;
  for (std::uint64_t bits = plan_.level_bodies; bits != 0; bits &= bits - 1) {
    const auto body = static_cast<std::size_t>(std::countr_zero(bits));
    if (world.is_absent(body_id_at(body))) status_.absent |= bit(body);
  }
}

/// Moves bodies back to their start. A body stays where it is while a hand touches it or is near its start, so that no
/// force jumps.
void Game::return_bodies(physics::World& world, std::uint32_t hands) const noexcept {
  for (std::uint64_t bits = returnable_ & ~status_.absent; bits != 0; bits &= bits - 1) {
    const auto body = static_cast<std::size_t>(std::countr_zero(bits));
    const BodyId id = body_id_at(body);
    if (world.hands_on(id) != 0 || is_near_hand(world, hands, body)) continue;
    world.set_body(id, {scene_.world.bodies[body].X_WB, Twist{}});
  }
}

void Game::apply_level(physics::World& world) noexcept {
  ++status_.entries;
  set_weightless(status_.is_weightless, world);
  if (plan_.sets_coupling) world.set_coupling(*level().law, level().coupling);
}

bool Game::is_near_hand(const physics::World& world, std::uint32_t hands, std::size_t body) const noexcept {
  const physics::BodyDescription& description = scene_.world.bodies[body];
  const Vec3 place_W = description.mass.mass_kg > 0 ? description.X_WB.p : world.body(body_id_at(body)).X.p;
  for (std::size_t tool = 0; tool < scene_.world.tools.size(); ++tool) {
    if ((hands >> tool & 1U) == 0) continue;
    const physics::ToolState state = world.tool(tool);
    double reach_m = (state.tool.X.p - place_W).norm() - tool_radius_m_[tool];
    if (state.held.is_valid()) {
      const std::size_t held = state.held.value - 1;
      const double of_held_m = (world.body(state.held).X.p - place_W).norm() - scene_.world.bodies[held].touch.radius_m;
      reach_m = std::min(reach_m, of_held_m);
    }
    if (reach_m < description.touch.radius_m + kClearance_m) return true;
  }
  return false;
}

/// Removes the bodies that the level lacks, and adds the bodies that are new in it. A change is postponed while a hand
/// could feel it.
void Game::exchange_bodies(physics::World& world, std::uint32_t hands) noexcept {
  for (std::uint64_t bits = status_.absent ^ level().absent; bits != 0; bits &= bits - 1) {
    const auto body = static_cast<std::size_t>(std::countr_zero(bits));
    const BodyId id = body_id_at(body);
    const bool is_static = scene_.world.bodies[body].mass.mass_kg <= 0;
    const bool leaves = (level().absent & bit(body)) != 0;
    const bool must_wait = leaves && !is_static ? world.hands_on(id) != 0 : is_near_hand(world, hands, body);
    if (must_wait) continue;
    if (leaves) {
      world.remove_body(id);
    } else if (is_static) {
      world.restore_body(id);
    } else {
      world.set_body(id, {scene_.world.bodies[body].X_WB, Twist{}});
    }
    status_.absent ^= bit(body);
  }
}

void Game::read_bodies(const physics::World& world, std::uint32_t hands) noexcept {
  for (const std::size_t body : plan_.bodies) {
    states_[body] = world.body(body_id_at(body));
    holders_[body] = 0;
  }
  for (std::size_t tool = 0; tool < scene_.world.tools.size(); ++tool) {
    if ((hands >> tool & 1U) == 0) continue;
    const BodyId held = world.tool(tool).held;
    if (held.is_valid()) ++holders_[held.value - 1];
  }
}

void Game::begin_step(Step step) noexcept {
  events_.clear();
  status_.step = step;
}

void Game::step(physics::World& world, std::uint32_t hands) noexcept {
  read_absent(world);
  exchange_bodies(world, hands);
  for (std::size_t i = 0; i < status_.signals.size(); ++i) advance(status_.signals[i], plan_.signals[i]);
  const bool has_players = static_cast<std::size_t>(std::popcount(hands)) >= plan_.players;
  if (status_.phase == GamePhase::kWaiting && has_players) {
    status_.phase = GamePhase::kPlaying;
    emit(GameEvent::Kind::kStarted);
    emit(GameEvent::Kind::kLevelStarted);
  }
  if (status_.phase == GamePhase::kPlaying && has_players) {
    read_bodies(world, hands);
    advance_fits();
    ++status_.steps;
    ++status_.level_steps;
    for (SignalStatus& signal : status_.signals) count_state(signal);
    for (std::size_t goal = 0; goal < status_.goals.size(); ++goal) evaluate(goal);
    end_level(world, hands);
  } else {
    interrupt_conditions();
  }
  const std::uint64_t period = std::max<std::uint64_t>(1, scene_.description.step_rate_hz() / kPublishedPerSecond);
  const bool has_ticked = shown_.steps != status_.steps && status_.step.value % period == 0;
  if (has_ticked || !events_.empty() || !is_same_but_time(shown_, status_)) publish();
}

/// Continues the silhouette search of one open goal by one placement. If several goals are open, their searches take
/// turns.
void Game::advance_fits() noexcept {
  boost::container::static_vector<std::size_t, kMaxSilhouettes> open;
  for (std::size_t i = 0; i < status_.goals.size(); ++i) {
    if (status_.goals[i].status != GoalStatus::kOpen) continue;
    for (const PlannedCondition& condition : level().goals[i].conditions) {
      const auto* const silhouette = std::get_if<SilhouetteCondition>(&condition.condition);
      if (silhouette != nullptr && open.size() < open.capacity()) open.push_back(silhouette->fit);
    }
  }
  if (!open.empty()) fits_[open[status_.level_steps % open.size()]].advance(states_, status_.absent);
}

/// Resets the silhouette searches and the times for which conditions have held. Called in each step in which the
/// clock of the game stands, because bodies may then move while no condition is evaluated.
void Game::interrupt_conditions() noexcept {
  for (SilhouetteFit& fit : fits_) fit.reset();
  for (GoalProgress& goal : status_.goals) goal.held_steps = 0;
}

bool Game::holds(const PlannedCondition& condition) const noexcept {
  if (const auto* const signal = std::get_if<SignalCondition>(&condition.condition)) {
    if (!status_.signals[signal->signal].is_fresh) return !signal->is_required;
  }
  BodyStates bodies{states_, holders_, status_.absent};
  bodies.signals = status_.signals;
  if (const auto* const silhouette = std::get_if<SilhouetteCondition>(&condition.condition)) {
    bodies.covered = fits_[silhouette->fit].is_covered() ? bit(silhouette->fit) : 0;
  }
  return server::holds(condition.condition, bodies) != condition.is_negated;
}

void Game::evaluate(std::size_t goal) noexcept {
  GoalProgress& progress = status_.goals[goal];
  if (progress.status != GoalStatus::kOpen) return;
  const PlannedGoal& planned = level().goals[goal];
  ++progress.steps;
  progress.satisfied = static_cast<std::uint8_t>(
      std::ranges::count_if(planned.conditions, [this](const PlannedCondition& one) { return holds(one); }));
  progress.held_steps = progress.satisfied >= planned.at_least ? progress.held_steps + 1 : 0;
  if (progress.held_steps > planned.hold_steps) {
    reach(goal);
  } else if (planned.limit_steps > 0 && progress.steps >= planned.limit_steps) {
    progress.status = GoalStatus::kFailed;
    emit(GameEvent::Kind::kGoalFailed, {.goal = static_cast<std::uint8_t>(goal), .by_time = true});
    if (planned.is_extra && level().is_in_order && goal + 1 < status_.goals.size()) {
      status_.goals[goal + 1].status = GoalStatus::kOpen;
    }
  }
}

void Game::reach(std::size_t goal) noexcept {
  GoalProgress& progress = status_.goals[goal];
  const PlannedGoal& planned = level().goals[goal];
  progress.status = GoalStatus::kReached;
  const std::uint64_t left = planned.limit_steps > progress.steps ? planned.limit_steps - progress.steps : 0;
  status_.level_score += planned.score + planned.score_per_step * static_cast<double>(left);
  emit(GameEvent::Kind::kGoalReached, {.goal = static_cast<std::uint8_t>(goal)});
  if (level().is_in_order && goal + 1 < status_.goals.size()) status_.goals[goal + 1].status = GoalStatus::kOpen;
}

/// Ends the level when it is reached or failed, and then selects what follows: the next level, a repetition, or the end
/// of the game. Also ends the game when one of its limits is exceeded.
void Game::end_level(physics::World& world, std::uint32_t hands) noexcept {
  bool is_reached = true, is_failed = false;
  for (std::size_t i = 0; i < status_.goals.size(); ++i) {
    if (level().goals[i].is_extra) continue;
    is_reached = is_reached && status_.goals[i].status == GoalStatus::kReached;
    is_failed = is_failed || status_.goals[i].status == GoalStatus::kFailed;
  }
  const bool is_over = level().limit_steps > 0 && status_.level_steps >= level().limit_steps;
  const bool has_ended = is_reached || is_failed || is_over;
  if (level().next) {
    if (has_ended && status_.level_steps >= min_round_steps_) end_round(is_reached, world, hands);
  } else if (is_reached) {
    status_.score += std::exchange(status_.level_score, 0);
    emit(GameEvent::Kind::kLevelReached);
    const std::size_t next = status_.level + std::size_t{1};
    if (next == plan_.levels.size()) return finish(GameEvent::Kind::kWon, {});
    enter_within_limits(next, world, hands);
  } else if (has_ended) {
    emit(GameEvent::Kind::kLevelFailed, {.by_time = true});
    if (!level().repeats) return finish(GameEvent::Kind::kLost, {.by_time = true});
    enter_within_limits(status_.level, world, hands);
  }
  if (status_.phase == GamePhase::kPlaying) check_limits();
}

/// Ends a level with a decision table. Its score counts whether the level was reached or failed, and the table selects
/// the next level.
void Game::end_round(bool is_reached, physics::World& world, std::uint32_t hands) noexcept {
  const LevelTable& table = *level().next;
  std::optional<std::size_t> dominant;
  if (table.signal) {
    dominant = dominant_state(status_.signals[*table.signal], status_.level_steps, table.dominant_share);
  }
  const std::size_t row = table.row_for(status_.level_score, dominant);
  status_.score += std::exchange(status_.level_score, 0);
  emit(is_reached ? GameEvent::Kind::kLevelReached : GameEvent::Kind::kLevelFailed, {.by_time = !is_reached});
  const bool is_last = row == table.rows.size() || !table.rows[row].level;
  if (!is_last) check_limits();
  if (status_.phase != GamePhase::kPlaying) return;
  emit(GameEvent::Kind::kLevelChosen, {.row = static_cast<std::uint8_t>(row)});
  if (is_last) return finish(GameEvent::Kind::kWon, {});
  enter(*table.rows[row].level, world, hands);
}

/// Starts a level, unless a limit of the game ends it in this step.
void Game::enter_within_limits(std::size_t level, physics::World& world, std::uint32_t hands) noexcept {
  check_limits();
  if (status_.phase == GamePhase::kPlaying) enter(level, world, hands);
}

/// Ends the game when its time limit is reached, or when the game has spent too much time in a state of a signal.
void Game::check_limits() noexcept {
  const auto end = [this](GameEvent reason, bool calls) {
    if (calls && !std::exchange(status_.has_called, true)) emit(GameEvent::Kind::kCalled, reason);
    finish(GameEvent::Kind::kLost, reason);
  };
  const auto& limit = plan_.state_limit;
  if (plan_.limit_steps > 0 && status_.steps >= plan_.limit_steps) {
    end({.by_time = true}, plan_.calls_at_time_limit);
  } else if (limit && status_.signals[limit->signal].steps[limit->state] >= limit->steps) {
    end({.by_state = true}, plan_.calls_at_state_limit);
  }
}

void Game::finish(GameEvent::Kind kind, GameEvent event) noexcept {
  status_.phase = kind == GameEvent::Kind::kWon ? GamePhase::kWon : GamePhase::kLost;
  emit(kind, event);
}

/// Completes an event and stores it.
/// In      event  goal, row and reasons
void Game::emit(GameEvent::Kind kind, GameEvent event) noexcept {
  event.kind = kind;
  event.level = status_.level;
  event.score = status_.total();
  event.step = status_.step;
  std::uint64_t& hash = status_.events_hash;
  const std::uint64_t indices = (std::uint64_t{event.row} << 16U) | (std::uint64_t{event.level} << 8U) | event.goal;
  hash = mixed(mixed(hash, static_cast<std::uint64_t>(kind)), indices | (event.by_state ? std::uint64_t{1} << 24U : 0));
  hash = mixed(mixed(hash, std::bit_cast<std::uint64_t>(event.score)), status_.steps);
  if (events_.size() < events_.capacity()) events_.push_back(event);
  if (!news_.push(event)) ++events_lost_;
}

void Game::publish() noexcept {
  shown_ = status_;
  published_.publish(status_);
}

bool is_same_but_time(const GameStatus& a, const GameStatus& b) noexcept {
  const auto is_same = [](const GoalProgress& x, const GoalProgress& y) {
    return x.status == y.status && x.satisfied == y.satisfied;
  };
  const auto is_same_signal = [](const SignalStatus& x, const SignalStatus& y) {
    return x.is_fresh == y.is_fresh && x.state == y.state;
  };
  return a.phase == b.phase && a.level == b.level && a.total() == b.total() && a.absent == b.absent &&
         a.entries == b.entries && a.is_weightless == b.is_weightless && a.events_hash == b.events_hash &&
         std::ranges::equal(a.goals, b.goals, is_same) && std::ranges::equal(a.signals, b.signals, is_same_signal);
}

std::uint32_t hash_of(const GameStatus& status) noexcept {
  std::uint64_t hash = kHashStart;
  const auto add = [&hash](std::uint64_t word) { hash = mixed(hash, word); };
  add(static_cast<std::uint64_t>(status.phase));
  add(status.level);
  for (const double number : {status.score, status.level_score}) add(std::bit_cast<std::uint64_t>(number));
  for (const std::uint64_t number : {status.steps, status.level_steps, status.absent, status.events_hash}) add(number);
  add((status.is_weightless ? 1U : 0U) | (status.has_called ? 2U : 0U));
  for (const GoalProgress& goal : status.goals) {
    add(static_cast<std::uint64_t>(goal.status));
    add(goal.steps);
    add(goal.held_steps);
  }
  for (const SignalStatus& signal : status.signals) {
    for (const double number : {signal.value, signal.confidence}) add(std::bit_cast<std::uint64_t>(number));
    add(signal.age_steps);
    add(signal.has_value ? 1 : 0);
    for (const std::uint64_t number : signal.level_steps) add(number);
    for (const std::uint64_t number : signal.steps) add(number);
  }
  return static_cast<std::uint32_t>(hash ^ (hash >> 32U));
}

}  // namespace tandem::server
