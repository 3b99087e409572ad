// Control of a tool by its user's inputs. Each ClientMode has one strategy, which matches how that client bridges the
// delay. The room selects it by the mode of the newest input, without a case for any single one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/room/tool_port.hpp"

namespace tandem::server {

/// Newest input of a user, and the one in use.
struct UserInput {
  proto::ClientUpdate newest;
  Duration arrived{0};       ///< time of arrival, in the room's steps
  Duration since_last{0};    ///< since the previous arrival
  bool has_arrived = false;  ///< an input has arrived
  bool has_gaps = false;     ///< the handle is extrapolated between inputs
  Tick answered;             ///< tick of the handle in use
  Wrench on_hand_W;          ///< wrench displayed to the hand at that tick, if the client reports it

  bool has_handle() const { return has_arrived && newest.handle_valid; }
  /// Approximate age of the handle in use: half of the round trip; 0: unknown.
  Duration handle_age() const { return newest.round_trip / 2; }
};

/// Strategy for one seat. Call order in a step: receive() for a new input, drive(), the world's step, settle().
///
/// Thread  room: no allocation, no throw
class ToolDriver {
 public:
  virtual ~ToolDriver() = default;

  /// Returns whether the grab button acts when drive() returns it, with the tool where its user had it; otherwise it
  /// acts on arrival.
  virtual bool delays_buttons() const noexcept { return false; }
  /// Accepts an input of the driver's mode that arrived in the step at `now`; its handle may be invalid.
  virtual void receive(const UserInput& input, Duration now) noexcept = 0;
  /// Sets the tool's handle and `answered` for the step at `now`.
  /// In      input  with a valid handle
  /// Out     buttons that act now, from a driver that delays buttons
  virtual std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept = 0;
  /// Called after the world's step, while the newest input has a handle.
  virtual void settle() noexcept {}
  /// Adds the tool's values for a client of this mode.
  virtual void describe(proto::OwnUpdate& /*update*/) const noexcept {}
  /// Discards pending inputs: there is no handle for now.
  virtual void stop() noexcept {}
  /// Prepares for another mode or another user.
  virtual void reset() noexcept { stop(); }
};

/// Indexed by ClientMode.
using ToolDrivers = std::array<std::unique_ptr<ToolDriver>, 3>;

/// Makes the drivers of one seat.
/// In      port  outlives them
ToolDrivers make_tool_drivers(Duration period, ToolPort& port);

}  // namespace tandem::server
