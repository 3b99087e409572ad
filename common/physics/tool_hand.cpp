#include "common/physics/tool_hand.hpp"

#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::physics {

void ToolHand::advance(double step_s) noexcept {
  fade_.advance(step_s);
}

void ToolHand::reset(const haptics::CouplingParameters& coupling) noexcept {
  release();
  brake_n_s_per_m_ = 0;
  fade_.jump_to(fade_.target_law(), coupling);
  energy_into_world_j_ = 0;
  energy_from_world_j_ = 0;
}

void ToolHand::set_handle(const RigidState& handle) noexcept {
  pulls_ = has_handle_ = true;
  target_ = handle;
}

void ToolHand::anchor_at(const Pose& X_WT) noexcept {
  pulls_ = true;
  has_handle_ = false;
  target_ = {X_WT, Twist{}};
  wrench_on_hand_W_ = Wrench{};
}

void ToolHand::release() noexcept {
  pulls_ = has_handle_ = false;
  wrench_on_tool_W_ = Wrench{};
  wrench_on_hand_W_ = Wrench{};
}

Joint ToolHand::tether(const Pose& X_WT) const noexcept {
  constexpr double kNoStretch = 1e-6;  // m, rad
  const haptics::CouplingState state = haptics::coupling_state(target_.X, target_.V, X_WT, target_.V);
  const Wrench pull = fade_.law().wrench_on_tool_W(state);
  const double d = state.d_W.norm(), theta = state.theta_W.norm();
  const haptics::CouplingParameters& c = fade_.parameters();
  Joint spring;
  spring.stiffness_n_per_m = d > kNoStretch ? pull.f.norm() / d : c.stiffness_n_per_m;
  spring.stiffness_n_m_per_rad = theta > kNoStretch ? pull.t.norm() / theta : c.stiffness_n_m_per_rad;
  return spring;
}

double ToolHand::stored_energy_j(const Pose& X_WT) const noexcept {
  if (!pulls()) return 0;
  constexpr int kPieces = 64;  // number of intervals for Simpson's rule; must be even
  const haptics::CouplingState end = haptics::coupling_state(target_.X, {}, X_WT, {});
  double sum = 0;
  for (int i = 0; i <= kPieces; ++i) {
    const double share = static_cast<double>(i) / kPieces;
    haptics::CouplingState state;
    state.d_W = share * end.d_W;
    state.theta_W = share * end.theta_W;
    const Wrench pull = fade_.law().wrench_on_tool_W(state);
    const double weight = i == 0 || i == kPieces ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * (pull.f.dot(end.d_W) + pull.t.dot(end.theta_W));
  }
  return sum / (3 * kPieces);
}

bool ToolHand::is_saturated() const noexcept {
  // With a hard limit (softness 0), a saturated force equals the limit, except for rounding. With a soft limit, the
  // force only approaches the limit. Therefore the upper half of the range in which the curve bends counts as
  // saturated.
  constexpr double kAtLimit = 1 - 1e-9;
  const haptics::CouplingParameters& c = fade_.parameters();
  const double share = kAtLimit * (1 - c.saturation_softness / 2);
  return pulls() && (wrench_on_tool_W_.f.norm() >= share * c.force_limit_n ||
                     wrench_on_tool_W_.t.norm() >= share * c.torque_limit_n_m);
}

void ToolHand::settle(const Pose& X_WT_before, const RigidState& tool, const Wrench& on_tool_W) noexcept {
  wrench_on_tool_W_ = on_tool_W;
  // Without a handle, the coupling pulls the tool to an earlier pose. No user does work then, so the work is not
  // summed. Adding an empty wrench converts negative zeros to zeros, which messages omit.
  const Wrench by_user_W = (has_handle() ? on_tool_W : Wrench{}) + Wrench{};
  if (has_handle()) wrench_on_hand_W_ = haptics::reaction_on_hand(by_user_W, target_.X.p - tool.X.p);
  const double work_j = held_work_j(by_user_W, X_WT_before, tool.X);
  (work_j > 0 ? energy_into_world_j_ : energy_from_world_j_) += std::abs(work_j);
}

}  // namespace tandem::physics
