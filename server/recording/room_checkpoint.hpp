// Checkpoint message from which a room resumes.
#pragma once

#include <optional>
#include <string>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::server {

/// Checkpoint of a room between its steps.
wire::RoomCheckpoint checkpoint_of(const Room& room);
wire::RoomCheckpoint checkpoint_of(const std::string& room, const LoadedScene& scene, const RoomState& state);
/// Fails   nothing: the checkpoint is of another scene, or a number is missing. Room::resume() checks the ranges
std::optional<RoomState> state_of(const wire::RoomCheckpoint& checkpoint, const LoadedScene& scene);

}  // namespace tandem::server
