// A simulated hand at the room's own table: no network, no client.
#pragma once

#include <cstdint>

#include "common/base/workspace.hpp"
#include "devices/sim/sim_device.hpp"
#include "server/room/room.hpp"

namespace tandem::lab {

/// Takes the room's tool of the same index when it is made, and holds it from then on.
///
/// Thread  that of the room
class SimulatedUser {
 public:
  /// In      seed  of the hand's tremor
  SimulatedUser(server::Room& room, std::size_t index, devices::HandPath path, std::uint64_t seed);

  Duration path_length() const { return device_.path().length(); }
  /// Before a step: where the hand is.
  void move(LocalTime now);
  /// After a step: the hand feels its wrench at once. Returns the wrench in W.
  Wrench feel(LocalTime now);

 private:
  server::Room& room_;
  std::uint8_t seat_;
  devices::SimDevice device_;
  WorkspaceMapping workspace_;
  Tick tick_;
};

}  // namespace tandem::lab
