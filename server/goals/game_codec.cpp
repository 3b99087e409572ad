#include "server/goals/game_codec.hpp"

#include <algorithm>

namespace tandem::server {

wire::GameState state_message(const GameStatus& status, const LoadedScene& scene) {
  const double step_s = scene.world.step_s;
  wire::GameState out;
  out.set_phase(static_cast<wire::GameState::Phase>(status.phase));
  out.set_level(status.level);
  out.set_score(status.total());
  out.set_elapsed_s(static_cast<double>(status.steps) * step_s);
  out.set_level_elapsed_s(static_cast<double>(status.level_steps) * step_s);
  for (const GoalProgress& goal : status.goals) {
    wire::GoalState& to = *out.add_goals();
    to.set_status(static_cast<wire::GoalState::Status>(goal.status));
    to.set_satisfied(goal.satisfied);
    to.set_elapsed_s(static_cast<double>(goal.steps) * step_s);
  }
  for (std::size_t i = 0; i < scene.world.bodies.size(); ++i) {
    if ((status.absent >> i & 1U) != 0) out.add_absent_bodies(body_id_at(i).value);
  }
  Vec3 gravity = Vec3::Zero();
  if (!status.is_weightless) {
    const auto& of_level = scene.description.game().levels(status.level).gravity_m_per_s2();
    gravity = {of_level[0], of_level[1], of_level[2]};
  }
  for (const double number : gravity) out.add_gravity_m_per_s2(number);
  out.set_step(status.step.value);
  for (const SignalStatus& signal : status.signals) {
    wire::SignalReport& to = *out.add_signals();
    if (!signal.is_fresh) continue;
    to.set_fresh(true);
    to.set_value(signal.value);
    to.set_confidence(signal.confidence);
    to.set_age_s(static_cast<double>(signal.age_steps) * step_s);
    to.set_state(signal.state);
  }
  return out;
}

wire::GameEvent event_message(const GameEvent& event) {
  wire::GameEvent out;
  out.set_kind(static_cast<wire::GameEvent::Kind>(event.kind));
  out.set_level(event.level);
  out.set_goal(event.goal);
  out.set_score(event.score);
  out.set_step(event.step.value);
  out.set_by_time(event.by_time);
  out.set_row(event.row);
  out.set_by_state(event.by_state);
  return out;
}

void write_checkpoint(const GameStatus& status, wire::GameCheckpoint& out) {
  out.set_phase(static_cast<wire::GameState::Phase>(status.phase));
  out.set_level(status.level);
  out.set_score(status.score);
  out.set_level_score(status.level_score);
  out.set_steps(status.steps);
  out.set_level_steps(status.level_steps);
  for (const GoalProgress& goal : status.goals) {
    wire::GoalCheckpoint& to = *out.add_goals();
    to.set_status(static_cast<wire::GoalState::Status>(goal.status));
    to.set_steps(goal.steps);
    to.set_held_steps(goal.held_steps);
  }
  out.set_is_weightless(status.is_weightless);
  out.set_absent_bodies(status.absent);
  out.set_events_hash(status.events_hash);
  for (const SignalStatus& signal : status.signals) {
    wire::SignalCheckpoint& to = *out.add_signals();
    for (const std::uint64_t number : signal.level_steps) to.add_level_steps(number);
    for (const std::uint64_t number : signal.steps) to.add_steps(number);
  }
  out.set_has_called(status.has_called);
}

std::optional<GameStatus> read_checkpoint(const wire::GameCheckpoint& in) {
  if (in.level() >= kMaxLevels || in.goals_size() > static_cast<int>(kMaxGoalsPerLevel) ||
      in.signals_size() > static_cast<int>(kMaxSignals) || !wire::GameState::Phase_IsValid(in.phase())) {
    return std::nullopt;
  }
  GameStatus status;
  status.phase = static_cast<GamePhase>(in.phase());
  status.level = static_cast<std::uint8_t>(in.level());
  status.score = in.score();
  status.level_score = in.level_score();
  status.steps = in.steps();
  status.level_steps = in.level_steps();
  for (const wire::GoalCheckpoint& goal : in.goals()) {
    if (!wire::GoalState::Status_IsValid(goal.status())) return std::nullopt;
    status.goals.push_back({static_cast<GoalStatus>(goal.status()), 0, goal.steps(), goal.held_steps()});
  }
  status.is_weightless = in.is_weightless();
  status.events_hash = in.events_hash();
  for (const wire::SignalCheckpoint& signal : in.signals()) {
    if (signal.level_steps_size() != static_cast<int>(kMaxSignalStates) ||
        signal.steps_size() != signal.level_steps_size())
      return std::nullopt;
    SignalStatus& to = status.signals.emplace_back();
    std::ranges::copy(signal.level_steps(), to.level_steps.begin());
    std::ranges::copy(signal.steps(), to.steps.begin());
  }
  status.has_called = in.has_called();
  return status;
}

}  // namespace tandem::server
