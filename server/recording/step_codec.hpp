// Commands and inputs of a room's steps as recording messages, and back. They keep all bits, so that the steps can be
// repeated.
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

/// Input taken by a step.
struct TakenInput {
  std::size_t seat = 0;
  proto::ClientUpdate update;
};
wire::RecordedInput recorded(const TakenInput& input);
/// Fails   nothing: a server would not have accepted this input
std::optional<TakenInput> input_of(const wire::RecordedInput& recorded);

/// Hash of each object's state after a step: equal worlds have equal hashes.
struct StateHashes {
  boost::container::static_vector<std::uint32_t, proto::kMaxBodies + 8> bodies;  ///< scene order, then soft bodies
  boost::container::static_vector<std::uint32_t, proto::kMaxUsers> tools;        ///< scene order

  bool operator==(const StateHashes&) const = default;
};
/// Thread  room: no allocation
StateHashes hashes_of(const Room& room) noexcept;

}  // namespace tandem::server
