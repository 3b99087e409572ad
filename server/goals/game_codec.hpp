// Messages of a game: the state and the events that users receive, and the state in checkpoints and recordings.
#pragma once

#include <optional>

#include "server/goals/game.hpp"
#include "tandem/goals.pb.h"

namespace tandem::server {

/// Message for users. Times are converted to seconds of the room.
wire::GameState state_message(const GameStatus& status, const LoadedScene& scene);
wire::GameEvent event_message(const GameEvent& event);

void write_checkpoint(const GameStatus& status, wire::GameCheckpoint& out);
/// Fails   returns none for numbers out of range; Game::resume() checks that the state belongs to the scene
std::optional<GameStatus> read_checkpoint(const wire::GameCheckpoint& in);

}  // namespace tandem::server
