// Sound by ALSA's library libasound, which is loaded at run time, so that the window runs on machines without it.
#pragma once

#include <memory>

#include "client/view/sound/sound_player.hpp"

namespace tandem::client {

/// Returns an output to ALSA's device "default". The library is loaded by open(), which prints nothing.
std::unique_ptr<SoundSink> alsa_sink();

}  // namespace tandem::client
