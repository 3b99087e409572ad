// What a room's steps use, as messages of a recording and back: the same bits, so that the steps can be done again.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <optional>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::server {

wire::RecordedCommand recorded(const RoomCommand& command);
/// Fails   nothing: a number is out of its range
std::optional<RoomCommand> command_of(const wire::RecordedCommand& recorded);

/// An input that a step took.
struct TakenInput {
  std::size_t seat = 0;
  proto::ClientUpdate update;
};
wire::RecordedInput recorded(const TakenInput& input);
/// Fails   nothing: it is none that a server would have taken
std::optional<TakenInput> input_of(const wire::RecordedInput& recorded);

/// A number for the state of each thing after a step: two worlds that were stepped alike have the same.
struct StateHashes {
  boost::container::static_vector<std::uint32_t, proto::kMaxBodies + 8> bodies;  ///< as the scene's, then soft bodies
  boost::container::static_vector<std::uint32_t, proto::kMaxUsers> tools;        ///< as the scene's

  bool operator==(const StateHashes&) const = default;
};
/// Thread  the room's: no allocation
StateHashes hashes_of(const Room& room) noexcept;

}  // namespace tandem::server
