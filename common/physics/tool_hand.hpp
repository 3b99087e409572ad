// Coupling of one user's handle to a tool, and the work that is done through this coupling.
#pragma once

#include <string_view>

#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/law_fade.hpp"
#include "common/physics/joints/joint.hpp"

namespace tandem::physics {

/// Lever arm of the brake: the brake's rotational damping is its translational damping times the square of this arm.
/// The value is about the size of a grip.
inline constexpr double kBrakeLever_m = 0.03;

/// Coupling of a handle to a tool. In each step, coupling() is called before the solver, and settle() afterwards with
/// the solver's result.
///
/// Model   work of step k = F_k · (x_{k+1} − x_k) + τ_k · θ_{k,k+1}, with the mean wrench (F, τ) of the step about the
///         tool's origin. Positive and negative work are summed separately, so neither sum ever decreases. A receiver
///         needs only the latest sums, and lost messages do no harm
class ToolHand {
 public:
  /// In      law  a name known to find_coupling_law()
  ToolHand(std::string_view law, const haptics::CouplingParameters& coupling)
      : fade_(*haptics::find_coupling_law(law), coupling) {}

  /// Sets a new law and new coefficients as a target. advance() fades from the present ones to the target (LawFade).
  void set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& coupling) noexcept {
    fade_.fade_to(law, coupling);
  }
  void advance(double step_s) noexcept;
  /// Resets the state for a new user: no handle, sums of work zero. Sets the coefficients without a fade.
  void reset(const haptics::CouplingParameters& coupling) noexcept;
  void set_handle(const RigidState& handle) noexcept;
  /// Couples the tool to its present pose, as a target at rest, until the next set_handle().
  void anchor_at(const Pose& X_WT) noexcept;
  /// Ends the coupling to a handle or pose.
  void release() noexcept;

  /// Sets an additional damping of the tool's velocity in the world; initially 0.
  void set_brake(double n_s_per_m) noexcept { brake_n_s_per_m_ = n_s_per_m; }

  bool has_handle() const { return has_handle_; }
  bool pulls() const { return pulls_; }
  /// Kind of tool (ToolDynamics) that the law requires while the tool holds nothing.
  haptics::ToolDynamics dynamics() const { return fade_.law().tool_dynamics(); }
  /// Coefficients that currently apply.
  const haptics::CouplingParameters& parameters() const { return fade_.parameters(); }
  /// Pose to which the tool is coupled; valid only while pulls().
  const Pose& target_pose() const { return target_.X; }
  const RigidState& target() const { return target_; }

  /// Input for the solver: the coupling acting on `body`, with the tool at `X_WT`. Valid only while pulls().
  contact::SolverCoupling coupling(int body, const Pose& X_WT) const noexcept {
    return {body,
            &fade_.law(),
            target_.X,
            target_.V,
            X_WT,
            brake_n_s_per_m_,
            brake_n_s_per_m_ * kBrakeLever_m * kBrakeLever_m};
  }
  /// Returns the linear spring without damping that has the same force as the coupling for a tool at `X_WT`: its
  /// stiffness is force divided by displacement. Valid only while pulls().
  Joint tether(const Pose& X_WT) const noexcept;
  /// Elastic energy stored in the coupling to a tool at `X_WT`: the integral of the static force over the displacement.
  double stored_energy_j(const Pose& X_WT) const noexcept;
  /// Adds the work of a step in which the tool moved from `X_WT_before`. `on_tool_W` is the coupling's wrench about the
  /// tool's origin.
  void settle(const Pose& X_WT_before, const RigidState& tool, const Wrench& on_tool_W) noexcept;
  /// Returns whether the force or torque of the last step was saturated: more than halfway through the range in which
  /// the saturation curve bends.
  bool is_saturated() const noexcept;

  /// Wrench of the last step on the hand, about the handle (reaction_on_hand()); zero without a handle.
  Wrench wrench_on_hand_W() const noexcept { return wrench_on_hand_W_; }
  double energy_into_world_j() const { return energy_into_world_j_; }
  double energy_from_world_j() const { return energy_from_world_j_; }

 private:
  haptics::LawFade fade_;
  double brake_n_s_per_m_ = 0;
  bool pulls_ = false;
  bool has_handle_ = false;  ///< true: the target is a handle; false: it is an earlier pose of the tool
  RigidState target_;
  Wrench wrench_on_tool_W_;
  Wrench wrench_on_hand_W_;
  double energy_into_world_j_ = 0;
  double energy_from_world_j_ = 0;
};

}  // namespace tandem::physics
