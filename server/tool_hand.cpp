#include "server/tool_hand.hpp"

#include <cmath>

#include "common/work.hpp"

namespace tandem {

void ToolHand::advance(double step_s) noexcept {
  if (ramp_.advance(step_s)) law_->set_parameters(ramp_.now());
}

void ToolHand::reset(const CouplingParameters& coupling) noexcept {
  let_go();
  ramp_.jump_to(coupling);
  law_->set_parameters(coupling);
  energy_into_world_j_ = 0;
  energy_from_world_j_ = 0;
}

void ToolHand::set_handle(const RigidState& handle) noexcept {
  source_ = Source::kHandle;
  target_ = handle;
}

void ToolHand::anchor_at(const Pose& X_WT) noexcept {
  source_ = Source::kAnchor;
  target_ = {X_WT, Twist{}};
  wrench_on_hand_W_ = Wrench{};
}

void ToolHand::let_go() noexcept {
  source_ = Source::kNone;
  wrench_on_tool_W_ = Wrench{};
  wrench_on_hand_W_ = Wrench{};
}

CouplingTether ToolHand::tether(const Pose& X_WT) const noexcept {
  constexpr double kNoStretch = 1e-6;  // m, rad
  const CouplingState state = coupling_state(target_.X, target_.V, X_WT, target_.V);
  const Wrench pull = law_->wrench_on_tool_W(state);
  const double d = state.d_W.norm(), theta = state.theta_W.norm();
  const CouplingParameters& c = ramp_.now();
  return {d > kNoStretch ? pull.f.norm() / d : c.stiffness_n_per_m,
          theta > kNoStretch ? pull.t.norm() / theta : c.stiffness_n_m_per_rad};
}

bool ToolHand::is_saturated() const noexcept {
  // A bent force never quite reaches its limit, and without a bend it does so up to rounding.
  constexpr double kAtLimit = 1 - 1e-9;
  const CouplingParameters& c = ramp_.now();
  const double share = kAtLimit * (1 - c.saturation_softness / 2);
  return pulls() && (wrench_on_tool_W_.f.norm() >= share * c.force_limit_n ||
                     wrench_on_tool_W_.t.norm() >= share * c.torque_limit_n_m);
}

void ToolHand::settle(const Pose& X_WT_before, const RigidState& tool, const Wrench& on_tool_W) noexcept {
  wrench_on_tool_W_ = on_tool_W;
  if (!has_handle()) return;
  wrench_on_hand_W_ = reaction_on_hand(on_tool_W, target_.X.p - tool.X.p);
  const double work = held_work_j(on_tool_W, X_WT_before, tool.X);
  (work > 0 ? energy_into_world_j_ : energy_from_world_j_) += std::abs(work);
}

}  // namespace tandem
