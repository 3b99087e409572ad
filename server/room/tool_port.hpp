// What goes through between a user and the world: his handle pulls his tool, and the energy that the tool puts into the
// world is accounted for.
#pragma once

#include <optional>

#include "common/base/tick_faults.hpp"
#include "common/haptics/passivity/tool_passivity_controller.hpp"
#include "common/physics/world.hpp"

namespace tandem::server {

/// One seat's.
///
/// Thread  the room's: no throw
class ToolPort {
 public:
  /// In      world  outlives it
  ///         is_limited  the tool puts no more into the world than the hand put in (ToolPassivityController)
  ToolPort(physics::World& world, bool is_limited) : world_(world), is_limited_(is_limited) {}

  /// A new user takes a tool; it appears in the world.
  /// In      bounds  of the coupling, that the user's device bears, in the world
  void open(std::size_t tool, const haptics::CouplingParameters& bounds) noexcept;
  /// He leaves, and the tool with him.
  void close() noexcept;
  std::size_t tool() const noexcept { return tool_; }
  physics::ToolState state() const noexcept { return world_.tool(tool_); }
  /// In a gap of its inputs the hand is to be taken as going on: its tool presses on a thing with another's, or holds one
  /// that nothing presses on, or another's hand too, itself or through other things.
  bool runs_on() const noexcept;
  /// In force now.
  const haptics::CouplingParameters& coupling() const noexcept { return world_.coupling(tool_); }

  /// The tool is pulled there, until the next call.
  void set_handle(const RigidState& handle) noexcept;
  /// There is no handle until the next set_handle(), and nothing else pulls for the user.
  void clear_handle() noexcept;

  /// The client's running sums of energy when its handle was at `X_WH`; `elapsed_s` since those before. Of what it says
  /// its hand put in counts what a hand can do on that way against the strongest pull of its coupling.
  void report(const Pose& X_WH, double from_hand_j, double to_hand_j, double elapsed_s) noexcept;
  /// Before a step: limits what pulls for the user to the energy that the hand put in.
  TickFaults limit(double step_s) noexcept;
  /// After a step: measures what the tool did.
  void settle() noexcept;
  const haptics::ToolPassivityController& passivity() const noexcept { return passivity_; }
  /// What the passivity controller's brake took out of the tool's motion, of all who had this port.
  double braked_j() const noexcept { return braked_j_; }

 private:
  physics::World& world_;
  bool is_limited_;
  std::size_t tool_ = 0;
  bool has_handle_ = false;
  std::optional<Pose> reported_at_;  ///< X_WH
  haptics::ToolPassivityController passivity_;
  double brake_n_s_per_m_ = 0;  ///< in the step under way
  double step_s_ = 0;
  double braked_j_ = 0;
};

}  // namespace tandem::server
