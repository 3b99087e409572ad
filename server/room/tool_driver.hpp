// Control of a tool by its user's inputs. There is one strategy (driver) per ClientMode, because each mode of a client
// bridges the network delay in a different way. The room selects the driver by the mode of the newest input.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/room/tool_port.hpp"

namespace tandem::server {

/// Newest input of a user, with the tick and the wrench of the handle in use.
struct UserInput {
  proto::ClientUpdate newest;
  Duration arrived{0};       ///< simulated time of the room at which the newest input arrived
  Duration since_last{0};    ///< time since the previous arrival
  bool has_arrived = false;  ///< whether an input has arrived
  bool has_gaps = false;     ///< whether the client suppresses inputs (deadband); the handle is then extrapolated
  Tick answered;             ///< tick of the handle in use
  Wrench on_hand_W;  ///< wrench on the hand at the tick `answered`, reported by the client or computed by the driver

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

  /// Returns whether buttons are delayed together with the motion: they act when drive() returns them, with the tool at
  /// the pose at which the user pressed them. If false, buttons act when their input arrives.
  virtual bool delays_buttons() const noexcept { return false; }
  /// Accepts an input for the mode of this driver that arrived in the step at `now`. Its handle may be invalid.
  virtual void receive(const UserInput& input, Duration now) noexcept = 0;
  /// Sets the tool's handle and `answered` (the tick of that handle) for the step at `now`.
  /// In      input  has a valid handle
  /// Out     buttons that act in this step; nothing from a driver that does not delay buttons
  virtual std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept = 0;
  /// Evaluates the world's step, for example the energy that the tool has exchanged. Called after the step, provided
  /// that the newest input has a handle.
  virtual void settle() noexcept {}
  /// Adds the values that only clients of this mode use to an update.
  virtual void describe(proto::OwnUpdate& /*update*/) const noexcept {}
  /// Discards queued inputs. Called when there is no valid handle.
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
