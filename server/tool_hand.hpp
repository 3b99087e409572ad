// One user's pull on the world: the coupling from handle to tool, and the account of the work it does.
#pragma once

#include <memory>
#include <string_view>

#include "common/coupling.hpp"
#include "proto/state.hpp"

namespace tandem {

/// Per step: pull() before, account() after.
///
/// Model   work of a step = F_k · (x_{k+1} − x_k) + τ_k · θ_{k,k+1}, the wrench about T held over the step; its
///         positive and negative parts are summed apart, so that both sums only grow and loss of an update does no harm
class ToolHand {
 public:
  /// In      law  a name that make_coupling_law() knows
  ToolHand(std::string_view law, const CouplingParameters& coupling)
      : law_(make_coupling_law(law, coupling)), coupling_(coupling) {}

  void set_coupling(const CouplingParameters& coupling) noexcept;
  /// A new user: no handle, empty account.
  void reset() noexcept;
  void set_handle(const RigidState& handle) noexcept;
  /// Pulls to where the tool is now, at rest, until the next handle.
  void anchor_at(const Pose& X_WT) noexcept;
  /// Pulls no more.
  void let_go() noexcept;

  bool has_handle() const { return source_ == Source::kHandle; }
  bool pulls() const { return source_ != Source::kNone; }

  /// Wrench on the tool about its origin; zero without something to pull to.
  Wrench pull(const RigidState& tool) noexcept;
  /// The last pull reached the coupling's force or torque limit.
  bool is_saturated() const noexcept;
  void account(const Pose& X_WT_after) noexcept;

  /// Of the last pull, about the handle (coupling_wrenches()). Zero without a handle.
  Wrench wrench_on_hand_W() const noexcept { return wrench_on_hand_W_; }
  double energy_into_world_j() const { return energy_into_world_j_; }
  double energy_from_world_j() const { return energy_from_world_j_; }

 private:
  enum class Source { kNone, kHandle, kAnchor };

  std::unique_ptr<CouplingLaw> law_;
  CouplingParameters coupling_;
  Source source_ = Source::kNone;
  RigidState target_;
  Pose X_WT_before_;
  Wrench wrench_on_tool_W_;
  Wrench wrench_on_hand_W_;
  double energy_into_world_j_ = 0;
  double energy_from_world_j_ = 0;
};

}  // namespace tandem
