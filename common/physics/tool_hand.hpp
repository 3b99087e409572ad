// One user's pull on the world: the coupling from handle to tool, and the account of the work it does.
#pragma once

#include <string_view>

#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/law_fade.hpp"
#include "common/physics/joints/joint.hpp"

namespace tandem::physics {

/// At which a brake that holds a tool back in turning is the brake of its translation: about the reach of a grip.
inline constexpr double kBrakeLever_m = 0.03;

/// Per step: coupling() before the solver, settle() with what it found.
///
/// Model   work of a step = F_k · (x_{k+1} − x_k) + τ_k · θ_{k,k+1}, the mean wrench of the step about T; its
///         positive and negative parts are summed apart, so that both sums only grow and loss of an update does no harm
class ToolHand {
 public:
  /// In      law  a name that find_coupling_law() knows
  ToolHand(std::string_view law, const haptics::CouplingParameters& coupling)
      : fade_(*haptics::find_coupling_law(law), coupling) {}

  /// Moves there (LawFade), with advance().
  void set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& coupling) noexcept {
    fade_.go_to(law, coupling);
  }
  void advance(double step_s) noexcept;
  /// A new user, with this coupling at once: no handle, empty account.
  void reset(const haptics::CouplingParameters& coupling) noexcept;
  void set_handle(const RigidState& handle) noexcept;
  /// Pulls to where the tool is now, at rest, until the next handle.
  void anchor_at(const Pose& X_WT) noexcept;
  /// Pulls no more.
  void let_go() noexcept;

  /// The coupling also holds the tool back by this times its velocity; 0 at first.
  void set_brake(double n_s_per_m) noexcept { brake_n_s_per_m_ = n_s_per_m; }

  bool has_handle() const { return has_handle_; }
  bool pulls() const { return pulls_; }
  /// What the law makes of a tool that holds nothing.
  haptics::ToolDynamics dynamics() const { return fade_.law().tool_dynamics(); }
  /// In force now.
  const haptics::CouplingParameters& parameters() const { return fade_.parameters(); }
  /// Where the tool is pulled to. Only while it pulls.
  const Pose& target_pose() const { return target_.X; }
  const RigidState& target() const { return target_; }

  /// What the solver needs to know of the pull on `body`, the tool being at `X_WT` now. Only while it pulls.
  contact::SolverCoupling coupling(int body, const Pose& X_WT) const noexcept {
    return {body,
            &fade_.law(),
            target_.X,
            target_.V,
            X_WT,
            brake_n_s_per_m_,
            brake_n_s_per_m_ * kBrakeLever_m * kBrakeLever_m};
  }
  /// As a spring: force over displacement, as stretched to a tool at `X_WT`; without damping. Only while it pulls.
  Joint tether(const Pose& X_WT) const noexcept;
  /// What the law's elastic part holds of the stretch to a tool at `X_WT`: its force at rest, along the way there.
  double stored_energy_j(const Pose& X_WT) const noexcept;
  /// After a step in which the tool came from `X_WT_before` and the coupling did `on_tool_W`, about the tool's origin.
  void settle(const Pose& X_WT_before, const RigidState& tool, const Wrench& on_tool_W) noexcept;
  /// The last step's force or torque was at its limit: past half of the bend that saturation makes.
  bool is_saturated() const noexcept;

  /// Of the last step, about the handle (reaction_on_hand()). Zero without a handle.
  Wrench wrench_on_hand_W() const noexcept { return wrench_on_hand_W_; }
  double energy_into_world_j() const { return energy_into_world_j_; }
  double energy_from_world_j() const { return energy_from_world_j_; }

 private:
  haptics::LawFade fade_;
  double brake_n_s_per_m_ = 0;
  bool pulls_ = false;
  bool has_handle_ = false;  ///< and pulls to it; else to where the tool was
  RigidState target_;
  Wrench wrench_on_tool_W_;
  Wrench wrench_on_hand_W_;
  double energy_into_world_j_ = 0;
  double energy_from_world_j_ = 0;
};

}  // namespace tandem::physics
