#include "common/contact/solver/coupling_term.hpp"

namespace tandem::contact {
CouplingTerm::CouplingTerm(const SolverCoupling& coupling, const SolverBody& body, double step_s)
    : law_(coupling.law),
      brake_n_s_per_m_(coupling.brake_n_s_per_m),
      brake_n_m_s_per_rad_(coupling.brake_n_m_s_per_rad),
      X_WH_(coupling.X_WH),
      V_WH_(coupling.V_WH),
      q_WT_(coupling.X_WT.q),
      p_WC_(body.p_WC),
      r_W_(coupling.X_WT.p - body.p_WC),
      step_s_(step_s) {}

Wrench CouplingTerm::evaluate(const Twist& V_WC) noexcept {
  if (is_linear_) {
    const Vec6 wrench = wrench_ - derivative_ * ((Vec6() << V_WC.v, V_WC.w).finished() - at_);
    const Vec3 force = wrench.head<3>(), torque = wrench.tail<3>();
    on_tool_W_ = {force, torque - lever_W_.cross(force)};
    return {force, torque};
  }
  const Quat turn = quaternion_of(V_WC.w * step_s_);
  lever_W_ = turn * r_W_;
  const Pose X_WT{p_WC_ + V_WC.v * step_s_ + lever_W_, (turn * q_WT_).normalized()};
  const Twist V_WT{V_WC.v + V_WC.w.cross(lever_W_), V_WC.w};
  state_ = haptics::coupling_state(X_WH_, V_WH_, X_WT, V_WT);
  const Wrench brake{brake_n_s_per_m_ * V_WT.v, brake_n_m_s_per_rad_ * V_WT.w};
  on_tool_W_ = law_->wrench_on_tool_W(state_) - brake;
  return {on_tool_W_.f, on_tool_W_.t + lever_W_.cross(on_tool_W_.f)};
}

void CouplingTerm::linearise(const Twist& V_WC) noexcept {
  const Wrench wrench = evaluate(V_WC);
  derivative_ = derivative();
  wrench_ << wrench.f, wrench.t;
  at_ << V_WC.v, V_WC.w;
  is_linear_ = true;
}

Mat6 CouplingTerm::derivative() const noexcept {
  if (is_linear_) return derivative_;
  haptics::CouplingGradient gradient = law_->gradient(state_);
  gradient.force_by_v.diagonal().array() += brake_n_s_per_m_;
  gradient.torque_by_w.diagonal().array() += brake_n_m_s_per_rad_;
  const Eigen::Matrix3d direct = step_s_ * gradient.force_by_d + gradient.force_by_v;
  const Eigen::Matrix3d lever = cross_matrix(lever_W_);
  const Eigen::Matrix3d turned = lever * direct;
  Mat6 k;
  k.topLeftCorner<3, 3>() = direct;
  k.bottomLeftCorner<3, 3>() = turned;
  k.topRightCorner<3, 3>() = turned.transpose();
  k.bottomRightCorner<3, 3>() = step_s_ * gradient.torque_by_theta + gradient.torque_by_w - turned * lever;
  return k;
}

}  // namespace tandem::contact
