// Coupling of one user's handle to a tool, with the account of its work.
#pragma once

#include <string_view>

#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/law_fade.hpp"
#include "common/physics/joints/joint.hpp"

namespace tandem::physics {

/// Lever of the brake: its rotational damping is the translational one times the lever squared. About the reach of a
/// grip.
inline constexpr double kBrakeLever_m = 0.03;

/// Coupling of a handle to a tool. Each step calls coupling() before the solver and settle() with its result.
///
/// Model   work of a step = F_k · (x_{k+1} − x_k) + τ_k · θ_{k,k+1}, with the mean wrench of the step about T. Positive
///         and negative work are summed separately: both sums only grow, so a lost update does no harm
class ToolHand {
 public:
  /// In      law  a name that find_coupling_law() accepts
  ToolHand(std::string_view law, const haptics::CouplingParameters& coupling)
      : fade_(*haptics::find_coupling_law(law), coupling) {}

  /// Sets law and coefficients; advance() fades to them (LawFade).
  void set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& coupling) noexcept {
    fade_.fade_to(law, coupling);
  }
  void advance(double step_s) noexcept;
  /// Resets for a new user, with this coupling at once: no handle, empty account.
  void reset(const haptics::CouplingParameters& coupling) noexcept;
  void set_handle(const RigidState& handle) noexcept;
  /// Couples the tool to its present pose, at rest, until the next handle.
  void anchor_at(const Pose& X_WT) noexcept;
  /// Ends the coupling.
  void release() noexcept;

  /// Sets the additional damping of the tool's velocity in the world; 0 at first.
  void set_brake(double n_s_per_m) noexcept { brake_n_s_per_m_ = n_s_per_m; }

  bool has_handle() const { return has_handle_; }
  bool pulls() const { return pulls_; }
  /// Dynamics of a tool that holds nothing, as the law defines it.
  haptics::ToolDynamics dynamics() const { return fade_.law().tool_dynamics(); }
  /// Coefficients in force now.
  const haptics::CouplingParameters& parameters() const { return fade_.parameters(); }
  /// Pose that the tool is coupled to. Only while it pulls.
  const Pose& target_pose() const { return target_.X; }
  const RigidState& target() const { return target_; }

  /// Input for the solver: the coupling on `body`, with the tool at `X_WT`. Only while it pulls.
  contact::SolverCoupling coupling(int body, const Pose& X_WT) const noexcept {
    return {body,
            &fade_.law(),
            target_.X,
            target_.V,
            X_WT,
            brake_n_s_per_m_,
            brake_n_s_per_m_ * kBrakeLever_m * kBrakeLever_m};
  }
  /// Equivalent spring without damping: force over displacement, for the stretch to a tool at `X_WT`. Only while it
  /// pulls.
  Joint tether(const Pose& X_WT) const noexcept;
  /// Elastic energy stored in the coupling: the force at rest, integrated along the stretch to a tool at `X_WT`.
  double stored_energy_j(const Pose& X_WT) const noexcept;
  /// Accounts for a step in which the tool moved from `X_WT_before` under the coupling's wrench `on_tool_W` about the
  /// tool's origin.
  void settle(const Pose& X_WT_before, const RigidState& tool, const Wrench& on_tool_W) noexcept;
  /// Whether the last step's force or torque was at its limit: past half of the bend of the saturation.
  bool is_saturated() const noexcept;

  /// Wrench of the last step on the hand, about the handle (reaction_on_hand()). Zero without a handle.
  Wrench wrench_on_hand_W() const noexcept { return wrench_on_hand_W_; }
  double energy_into_world_j() const { return energy_into_world_j_; }
  double energy_from_world_j() const { return energy_from_world_j_; }

 private:
  haptics::LawFade fade_;
  double brake_n_s_per_m_ = 0;
  bool pulls_ = false;
  bool has_handle_ = false;  ///< coupled to a handle; else to a former pose of the tool
  RigidState target_;
  Wrench wrench_on_tool_W_;
  Wrench wrench_on_hand_W_;
  double energy_into_world_j_ = 0;
  double energy_from_world_j_ = 0;
};

}  // namespace tandem::physics
