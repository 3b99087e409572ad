// Conversion of the commands and inputs of a room's steps to recording messages and back. The conversion preserves
// every bit, so that the steps can be replayed exactly.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <optional>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::server {

wire::RecordedCommand recorded(const RoomCommand& command);
/// Converts a recorded command to a command of the room.
/// Fails   returns none if a number is out of range
std::optional<RoomCommand> command_of(const wire::RecordedCommand& recorded);

/// Client update that a step has read from the mailbox of a seat.
struct TakenInput {
  std::size_t seat = 0;
  proto::ClientUpdate update;
};
wire::RecordedInput recorded(const TakenInput& input);
/// Converts a recorded input to an input of the room.
/// Fails   returns none if a server would not have accepted this input
std::optional<TakenInput> input_of(const wire::RecordedInput& recorded);

/// Hashes of the states of bodies and tools after a step. Equal states have equal hashes.
struct StateHashes {
  boost::container::static_vector<std::uint32_t, proto::kMaxBodies + 9>
      bodies;  ///< hashes in the order of the scene, followed by soft bodies and the game
  boost::container::static_vector<std::uint32_t, proto::kMaxUsers> tools;  ///< hashes in the order of the scene

  bool operator==(const StateHashes&) const = default;
};
/// Returns the hashes of the room's state after its last step.
/// Thread  room; does not allocate
StateHashes hashes_of(const Room& room) noexcept;

}  // namespace tandem::server
