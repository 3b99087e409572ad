// Conversion between the state of a room and its checkpoint, the message from which the room can resume.
#pragma once

#include <optional>
#include <string>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::server {

/// Makes the checkpoint of a room. Call it between two steps.
wire::RoomCheckpoint checkpoint_of(const Room& room);
wire::RoomCheckpoint checkpoint_of(const std::string& room, const LoadedScene& scene, const RoomState& state);
/// Reads the state of a room from its checkpoint. Room::resume() checks the ranges of the numbers.
/// Fails   returns none if the checkpoint belongs to another scene or if a number is missing
std::optional<RoomState> state_of(const wire::RoomCheckpoint& checkpoint, const LoadedScene& scene);

}  // namespace tandem::server
