// A simulated hand that is coupled directly to a room, without network and client.
#pragma once

#include <cstdint>

#include "common/base/workspace.hpp"
#include "devices/sim/sim_device.hpp"
#include "server/room/room.hpp"

namespace tandem::lab {

/// A hand that holds the room's tool number `index` during its whole lifetime.
///
/// Thread  the room's thread
class SimulatedUser {
 public:
  /// Joins the room and takes its tool number `index`.
  /// In      seed  random seed of the hand's tremor
  SimulatedUser(server::Room& room, std::size_t index, devices::HandPath path, std::uint64_t seed);

  Duration path_length() const { return device_.path().length(); }
  /// Publishes the hand's pose to the room. Must be called before a step.
  void move(LocalTime now);
  /// Applies the wrench of the last step to the hand without delay. Returns the wrench in W. Must be called after the
  /// step.
  Wrench feel(LocalTime now);

 private:
  server::Room& room_;
  std::uint8_t seat_;
  devices::SimDevice device_;
  WorkspaceMapping workspace_;
  Tick tick_;
};

}  // namespace tandem::lab
