// Connection between one user's hand and the tool of that user in the world. The handle pulls the tool, and the port
// accounts for the energy that the tool gives to the world.
#pragma once

#include <optional>

#include "common/base/tick_faults.hpp"
#include "common/haptics/passivity/tool_passivity_controller.hpp"
#include "common/physics/world.hpp"

namespace tandem::server {

/// Sets the handle that pulls the tool of one seat, and limits the energy that the tool gives to the world.
///
/// Thread  room: no throw
class ToolPort {
 public:
  /// In      world  must outlive the port
  ///         is_limited  true: the tool gives no more energy to the world than the hand has supplied
  ///                     (ToolPassivityController)
  ToolPort(physics::World& world, bool is_limited) : world_(world), is_limited_(is_limited) {}

  /// Activates a tool for a new user, so that it appears in the world.
  /// In      bounds  largest coupling that the user's device can render, in the scale of the world
  void open(std::size_t tool, const haptics::CouplingParameters& bounds) noexcept;
  /// Removes the tool when its user leaves.
  void close() noexcept;
  std::size_t tool() const noexcept { return tool_; }
  physics::ToolState state() const noexcept { return world_.tool(tool_); }
  /// Returns whether the hand is to be extrapolated during a gap in its inputs. This holds in two cases: another tool
  /// acts on the touched or held object, directly or through other bodies; or the tool holds a body without contacts.
  bool runs_on() const noexcept;
  /// Returns the coupling in force for this tool, limited by the bounds of the user's device.
  const haptics::CouplingParameters& coupling() const noexcept { return world_.coupling(tool_); }

  /// Sets the handle that pulls the tool until the next call.
  void set_handle(const RigidState& handle) noexcept;
  /// Removes the handle until the next set_handle(). Meanwhile nothing pulls the tool.
  void clear_handle() noexcept;

  /// Reports the client's cumulative energies when the handle is at the pose `X_WH`, `elapsed_s` after the previous
  /// report. The energy credited to the hand is limited to the largest work that the force limits of the coupling
  /// permit along the path since the previous report.
  void report(const Pose& X_WH, double from_hand_j, double to_hand_j, double elapsed_s) noexcept;
  /// Sets a damping of the tool, the brake. It limits the energy with which the handle pulls the tool to the energy
  /// that the hand has supplied. Call it before a step.
  TickFaults limit(double step_s) noexcept;
  /// Call after a step. Measures the work of the tool on the world in that step.
  void settle() noexcept;
  const haptics::ToolPassivityController& passivity() const noexcept { return passivity_; }
  /// Returns the energy that the passivity controller has dissipated in the tool's motion [J], summed over all users of
  /// this port.
  double braked_j() const noexcept { return braked_j_; }

 private:
  physics::World& world_;
  bool is_limited_;
  std::size_t tool_ = 0;
  bool has_handle_ = false;
  std::optional<Pose> reported_at_;  ///< handle pose X_WH of the last report()
  haptics::ToolPassivityController passivity_;
  double brake_n_s_per_m_ = 0;  ///< damping of the brake in the current step
  double step_s_ = 0;
  double braked_j_ = 0;
};

}  // namespace tandem::server
