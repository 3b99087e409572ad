// What a room goes on from, as a message.
#pragma once

#include <optional>
#include <string>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::server {

/// Of a room between its steps.
wire::RoomCheckpoint checkpoint_of(const Room& room);
wire::RoomCheckpoint checkpoint_of(const std::string& room, const LoadedScene& scene, const RoomState& state);
/// Fails   nothing: it is of another scene, or a number is missing. Ranges are Room::resume()'s to check
std::optional<RoomState> state_of(const wire::RoomCheckpoint& checkpoint, const LoadedScene& scene);

}  // namespace tandem::server
