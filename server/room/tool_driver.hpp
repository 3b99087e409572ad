// How a user's inputs move his tool: one strategy for each ClientMode, that is for each way in which a client bridges
// the delay. The room chooses by the mode of the newest input and knows none of them by name.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/room/tool_port.hpp"

namespace tandem::server {

/// The newest input of a user, and which of his inputs is in use.
struct UserInput {
  proto::ClientUpdate newest;
  Duration arrived{0};     ///< when, in the room's steps
  Duration since_last{0};  ///< from the arrival of the one before
  bool is_there = false;   ///< one has come
  bool has_gaps = false;   ///< between inputs the handle goes on as it last moved
  Tick answered;           ///< whose handle is in use
  Wrench on_hand_W;        ///< what the hand was shown then, as far as its client tells

  bool has_handle() const { return is_there && newest.handle_valid; }
  /// How long ago the hand was where the handle in use is, about: half of the round trip; 0: not known.
  Duration handle_age() const { return newest.round_trip / 2; }
};

/// A strategy for one seat: in each step take() when an input has come, drive(), the world's step, settle().
///
/// Thread  the room's: no allocation, no throw
class ToolDriver {
 public:
  virtual ~ToolDriver() = default;

  /// The grab button acts when drive() says so and the tool is where its user had it; else as soon as it comes.
  virtual bool delays_buttons() const noexcept { return false; }
  /// An input that has come in the step at `now`, of the driver's mode; its handle may be invalid.
  virtual void take(const UserInput& input, Duration now) noexcept = 0;
  /// Sets the tool's handle for the step at `now`, and `answered`.
  /// In      input  with a valid handle
  /// Out     of a driver that delays buttons: those that act now
  virtual std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept = 0;
  /// After the world's step, while the newest input has a handle.
  virtual void settle() noexcept {}
  /// Adds what the client of this mode is told of its tool.
  virtual void describe(proto::OwnUpdate& /*update*/) const noexcept {}
  /// There is no handle for now: nothing that is on its way acts any more.
  virtual void stop() noexcept {}
  /// Another mode or another user follows.
  virtual void reset() noexcept { stop(); }
};

/// By the value of their ClientMode.
using ToolDrivers = std::array<std::unique_ptr<ToolDriver>, 3>;

/// For one seat.
/// In      port  outlives them
ToolDrivers make_tool_drivers(Duration period, ToolPort& port);

}  // namespace tandem::server
