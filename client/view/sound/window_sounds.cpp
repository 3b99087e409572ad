#include "client/view/sound/window_sounds.hpp"

#include <algorithm>
#include <utility>

namespace tandem::client {

void WindowSounds::add(const TickRecord& record) {
  force_n_ = std::max(force_n_, record.displayed_on_hand_D.f.norm());
}

void WindowSounds::follow(const View* view, const ClientIoSnapshot& io, bool is_on, LocalTime now) {
  if (view == nullptr) return;
  SoundState state{.force_n = std::exchange(force_n_, 0),
                   .is_touching = std::nullopt,
                   .is_ramping = (view->record.safety_faults & haptics::kSafetyRamping) != 0,
                   .held_body = view->record.held_body,
                   .game = io.game.get()};
  if (view->record.is_local) state.is_touching = !view->contacts_W.empty();
  for (const SoundCue& cue : events_.follow(state, now)) {
    if (is_on) player_.play(cue.sound, cue.gain, now);
  }
}

}  // namespace tandem::client
