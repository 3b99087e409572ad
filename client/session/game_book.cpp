#include "client/session/game_book.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/base/ids.hpp"
#include "common/net/text.hpp"
#include "proto/scene_ranges.hpp"
#include "proto/signals.hpp"
#include "proto/state.hpp"

namespace tandem::client {
namespace {

constexpr double kMaxScore = 1e14, kMaxElapsed_s = 1e9;

bool is_amount(double value, double most) {
  return std::isfinite(value) && std::abs(value) <= most;
}

bool is_time(double value) {
  return value >= 0 && value <= kMaxElapsed_s;
}

const wire::Say& say_of(const wire::GameEvent& event, const wire::Game& game) {
  using Event = wire::GameEvent;
  const wire::Level& level = game.levels(static_cast<int>(event.level()));
  switch (event.kind()) {
    case Event::GOAL_REACHED:
      return level.goals(static_cast<int>(event.goal())).reached();
    case Event::GOAL_FAILED:
      return level.goals(static_cast<int>(event.goal())).failed();
    case Event::LEVEL_STARTED:
      return level.started();
    case Event::LEVEL_REACHED:
      return level.reached();
    case Event::LEVEL_FAILED:
      return level.failed();
    case Event::WON:
      return game.won();
    case Event::LOST:
      return game.lost();
    case Event::LEVEL_CHOSEN:
      return level.next().rows(static_cast<int>(event.row())).say();
    case Event::CALLED:
      return game.call().said();
    default:
      return wire::Say::default_instance();
  }
}

std::string own_text(const wire::GameEvent& event, const wire::Game& game) {
  using Event = wire::GameEvent;
  const wire::Level& level = game.levels(static_cast<int>(event.level()));
  const std::string why = event.by_state()  ? ": " + game.state_limit().state() + " for too long"
                          : event.by_time() ? ": the time is over"
                                            : "";
  switch (event.kind()) {
    case Event::GOAL_REACHED:
      return "reached: " + level.goals(static_cast<int>(event.goal())).text();
    case Event::GOAL_FAILED:
      return "failed: " + level.goals(static_cast<int>(event.goal())).text() + why;
    case Event::LEVEL_STARTED:
      return "level " + std::to_string(event.level() + 1) + " of " + std::to_string(game.levels_size()) + ": " +
             level.text();
    case Event::LEVEL_REACHED:
      return "level " + std::to_string(event.level() + 1) + " is done";
    case Event::LEVEL_FAILED:
      return "level " + std::to_string(event.level() + 1) + " is failed" + why;
    case Event::WON:
      return "the game is won";
    case Event::LOST:
      return "the game is lost" + why;
    case Event::LEVEL_CHOSEN: {
      const std::string& next = level.next().rows(static_cast<int>(event.row())).level();
      return next.empty() ? "the last level is done" : "next level: " + next;
    }
    case Event::CALLED:
      return "help is called" + why;
    default:
      return game.title() + " begins";
  }
}

bool has_score(const wire::GameEvent& event) {
  return event.kind() != wire::GameEvent::STARTED && event.kind() != wire::GameEvent::LEVEL_STARTED;
}

}  // namespace

std::span<const wire::GameEvent> GameReport::last_events() const {
  std::size_t count = 0;
  while (count < std::min(events.size(), kMaxEventsTogether) &&
         events[events.size() - 1 - count].step() == events.back().step()) {
    ++count;
  }
  return std::span(events).last(count);
}

std::string text_of(const wire::GameEvent& event, const wire::Game& game) {
  const std::string& of_scene = say_of(event, game).text();
  std::string text = of_scene.empty() ? own_text(event, game) : of_scene;
  if (has_score(event)) text += " (score " + proto::number_text(event.score()) + ")";
  return net::printable(text);
}

Vec3 color_of(const wire::GameEvent& event, const wire::Game& game) {
  constexpr double kLightGrey = 0.9;
  const auto& color = say_of(event, game).color_rgb();
  return color.size() == 3 ? Vec3(color[0], color[1], color[2]) : Vec3::Constant(kLightGrey);
}

void GameBook::begin(const wire::Scene& scene) {
  *this = GameBook();
  game_ = scene.game();
  bodies_ = scene.bodies_size();
}

bool GameBook::receive(const wire::GameState& state) {
  if (state.level() >= static_cast<std::uint32_t>(game_.levels_size())) return false;
  const auto is_body = [this](std::uint32_t id) { return id >= 1 && id <= static_cast<std::uint32_t>(bodies_); };
  const auto is_goal = [](const wire::GoalState& goal) { return is_time(goal.elapsed_s()); };
  const auto is_signal = [this, number = 0](const wire::SignalReport& signal) mutable {
    const int states = game_.signals(number++).states_size();
    return proto::is_signal_value(signal.value()) && proto::is_confidence(signal.confidence()) &&
           is_time(signal.age_s()) && signal.state() <= static_cast<std::uint32_t>(states);
  };
  const double most_m_per_s2 = proto::scene_range("Scene.gravity_m_per_s2").high;
  const auto& gravity = state.gravity_m_per_s2();
  const bool fits = state.goals_size() == game_.levels(static_cast<int>(state.level())).goals_size() &&
                    std::ranges::all_of(state.goals(), is_goal) && is_amount(state.score(), kMaxScore) &&
                    is_time(state.elapsed_s()) && is_time(state.level_elapsed_s()) &&
                    state.signals_size() == game_.signals_size() && std::ranges::all_of(state.signals(), is_signal) &&
                    std::ranges::all_of(state.absent_bodies(), is_body) && gravity.size() == 3 &&
                    std::ranges::all_of(gravity, [&](double value) { return is_amount(value, most_m_per_s2); });
  if (!fits) return false;
  absent_ = 0;
  for (const std::uint32_t id : state.absent_bodies()) absent_ |= std::uint64_t{1} << (id - 1) % proto::kMaxBodies;
  gravity_ = Vec3(gravity[0], gravity[1], gravity[2]);
  report_ = std::make_shared<const GameReport>(GameReport{state, events_});
  return true;
}

std::string GameBook::receive(const wire::GameEvent& event) {
  if (event.level() >= static_cast<std::uint32_t>(game_.levels_size()) || !is_amount(event.score(), kMaxScore) ||
      event.goal() >= static_cast<std::uint32_t>(game_.levels(static_cast<int>(event.level())).goals_size())) {
    return {};
  }
  const wire::Level& level = game_.levels(static_cast<int>(event.level()));
  const bool is_choice = event.kind() == wire::GameEvent::LEVEL_CHOSEN;
  if (is_choice && event.row() >= static_cast<std::uint32_t>(level.next().rows_size())) return {};
  if (events_.size() == kMaxGameEvents) events_.erase(events_.begin());
  events_.push_back(event);
  if (report_) report_ = std::make_shared<const GameReport>(GameReport{report_->state, events_});
  return text_of(event, game_);
}

}  // namespace tandem::client
