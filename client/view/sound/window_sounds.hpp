// The sounds of a session: events of its frames, played by a thread.
#pragma once

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/sound/sound_events.hpp"
#include "client/view/sound/sound_player.hpp"

namespace tandem::client {

/// Plays short sounds for the events of a session. The events are found in the ticks and frames.
///
/// Thread  the one that runs the window
class WindowSounds {
 public:
  explicit WindowSounds(std::unique_ptr<SoundSink> sink) : player_(std::move(sink)) {}

  /// Adds a tick. Call for each tick, in order, so that a short contact between two frames is heard.
  void add(const TickRecord& record);
  /// Plays the sounds of a frame.
  /// In      view   newest view; null if none was received yet
  ///         is_on  false: the user has switched sounds off
  void follow(const View* view, const ClientIoSnapshot& io, bool is_on, LocalTime now);

 private:
  SoundEvents events_;
  double force_n_ = 0;  ///< largest displayed force since the last frame [N]
  SoundPlayer player_;
};

}  // namespace tandem::client
