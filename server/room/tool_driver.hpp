// Control of a tool by its user's inputs. Each ClientMode has one strategy, which matches the way in which that client
// bridges the delay. The room selects the driver by the mode of the newest input and treats all drivers alike.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/room/tool_port.hpp"

namespace tandem::server {

/// Newest input of a user, and the values in use.
struct UserInput {
  proto::ClientUpdate newest;
  Duration arrived{0};       ///< simulated time of the room when the newest input arrived
  Duration since_last{0};    ///< time since the previous arrival
  bool has_arrived = false;  ///< an input has arrived
  bool has_gaps = false;     ///< the client leaves gaps (deadband), between which the handle is extrapolated
  Tick answered;             ///< tick of the handle in use
  Wrench on_hand_W;          ///< wrench displayed to the hand at that tick, if the client reports it

  bool has_handle() const { return has_arrived && newest.handle_valid; }
  /// Returns the approximate age of the handle in use: half of the round trip; 0: unknown.
  Duration handle_age() const { return newest.round_trip / 2; }
};

/// Applies the inputs of one seat to its tool, in one mode of the client. Call order in a step: receive() for a new
/// input, drive(), the world's step, settle().
///
/// Thread  room: no allocation, no throw
class ToolDriver {
 public:
  virtual ~ToolDriver() = default;

  /// Returns whether the grab button acts when drive() returns it. The tool is then at the pose that its user felt.
  /// Otherwise the button acts on arrival.
  virtual bool delays_buttons() const noexcept { return false; }
  /// Accepts an input of the driver's mode that arrived in the step at `now`; its handle may be invalid.
  virtual void receive(const UserInput& input, Duration now) noexcept = 0;
  /// Sets the tool's handle and `answered` (the tick of that handle) for the step at `now`.
  /// In      input  has a valid handle
  /// Out     buttons that act now; nothing from a driver that does not delay buttons
  virtual std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept = 0;
  /// Called after the world's step if the newest input has a handle.
  virtual void settle() noexcept {}
  /// Adds to an update the values that a client of this mode needs.
  virtual void describe(proto::OwnUpdate& /*update*/) const noexcept {}
  /// Discards pending inputs, because there is no valid handle at present.
  virtual void stop() noexcept {}
  /// Prepares for another mode or another user.
  virtual void reset() noexcept { stop(); }
};

/// Drivers of one seat, indexed by ClientMode.
using ToolDrivers = std::array<std::unique_ptr<ToolDriver>, 3>;

/// Makes the drivers of one seat.
/// In      port  must outlive the drivers
ToolDrivers make_tool_drivers(Duration period, ToolPort& port);

}  // namespace tandem::server
