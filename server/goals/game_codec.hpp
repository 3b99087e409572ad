// Converts the state and the events of a game to messages for users, and the state to and from checkpoints and
// recordings.
#pragma once

#include <optional>

#include "server/goals/game.hpp"
#include "tandem/goals.pb.h"

namespace tandem::server {

/// Returns the message for users about the state of a game. Numbers of steps are converted to seconds.
wire::GameState state_message(const GameStatus& status, const LoadedScene& scene);
wire::GameEvent event_message(const GameEvent& event);

void write_checkpoint(const GameStatus& status, wire::GameCheckpoint& out);
/// Returns nothing if a number is out of range. Game::resume() checks in addition that the state fits the scene.
std::optional<GameStatus> read_checkpoint(const wire::GameCheckpoint& in);

}  // namespace tandem::server
