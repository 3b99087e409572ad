#include "client/view/sound/sound_events.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::client {
namespace {

/// Gain of the sound of a contact: value at zero force, and increase per newton.
constexpr double kSoft = 0.35, kLouder_per_n = 0.15;

std::optional<Sound> sound_of(wire::GameEvent::Kind kind) {
  switch (kind) {
    case wire::GameEvent::GOAL_REACHED:
    case wire::GameEvent::LEVEL_REACHED:
    case wire::GameEvent::WON:
      return Sound::kGoal;
    case wire::GameEvent::GOAL_FAILED:
    case wire::GameEvent::LEVEL_FAILED:
    case wire::GameEvent::LOST:
      return Sound::kFailure;
    default:
      return std::nullopt;
  }
}

}  // namespace

SoundCues SoundEvents::follow(const SoundState& state, LocalTime now) {
  SoundCues cues;
  add_contact(state, now, cues);
  add_grasp(state, cues);
  add_game(state, cues);
  has_state_ = true;
  last_ = now;
  return cues;
}

void SoundEvents::add_contact(const SoundState& state, LocalTime now, SoundCues& cues) {
  if (!is_new_contact(state, now) || (heard_at_ && now - *heard_at_ < kBetweenContacts)) return;
  heard_at_ = now;
  cues.push_back({Sound::kContact, std::min(1.0, kSoft + kLouder_per_n * state.force_n)});
}

/// Updates the stored time of touch and the mean force. Returns true if a new contact begins.
bool SoundEvents::is_new_contact(const SoundState& state, LocalTime now) {
  const double share = has_state_ ? 1 - std::exp(-std::max(0.0, to_seconds(now - last_)) / kForceMean_s) : 1;
  const double rise_n = state.force_n - mean_force_n_;
  mean_force_n_ += share * rise_n;
  const bool was_jolted = std::exchange(is_jolted_, rise_n > (is_jolted_ ? 0.2 * kJolt_n : kJolt_n));
  const bool begins = state.is_touching.value_or(false) && (!touched_at_ || now - *touched_at_ >= kApart);
  if (state.is_touching.value_or(false)) touched_at_ = now;
  return has_state_ && !state.is_ramping && (begins || (is_jolted_ && !was_jolted));
}

void SoundEvents::add_grasp(const SoundState& state, SoundCues& cues) {
  const BodyId before = std::exchange(held_body_, state.held_body);
  if (!has_state_ || before.is_valid() == held_body_.is_valid()) return;
  cues.push_back({held_body_.is_valid() ? Sound::kGrasp : Sound::kRelease, 0.7});
}

/// Adds at most one sound for the events of the game since the last frame: that of the last event that has a sound.
void SoundEvents::add_game(const SoundState& state, SoundCues& cues) {
  if (state.game == nullptr) return game_step_.reset();
  const auto& events = state.game->events;
  const std::optional<std::uint64_t> before =
      std::exchange(game_step_, events.empty() ? 0 : std::uint64_t{events.back().step()});
  if (!before) return;  // these events occurred before the user joined
  std::optional<Sound> sound;
  for (const wire::GameEvent& event : events) {
    const std::optional<Sound> of_event = sound_of(event.kind());
    if (event.step() > *before && of_event) sound = of_event;
  }
  if (sound) cues.push_back({*sound, 0.8});
}

}  // namespace tandem::client
