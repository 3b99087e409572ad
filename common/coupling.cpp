#include "common/coupling.hpp"

namespace tandem {
namespace {

/// Derivative of clamped_to_length(a, limit) by a.
Eigen::Matrix3d clamp_derivative(const Vec3& a, double limit) {
  const double largest = a.cwiseAbs().maxCoeff();
  if (!std::isfinite(largest) || !a.allFinite()) return Eigen::Matrix3d::Zero();
  if (largest <= 0) return Eigen::Matrix3d::Identity();
  const Vec3 scaled = a / largest;  // see clamped_to_length()
  const double length = scaled.norm() * largest;
  if (length <= limit) return Eigen::Matrix3d::Identity();
  const Vec3 along = scaled.normalized();
  return limit / length * (Eigen::Matrix3d::Identity() - along * along.transpose());
}

}  // namespace

CouplingState coupling_state(const Pose& X_WH, const Twist& V_WH, const Pose& X_WT, const Twist& V_WT) {
  const Vec3 d_W = X_WH.p - X_WT.p;
  return {d_W, rotation_vector(X_WH.q * X_WT.q.conjugate()), V_WH.v - V_WH.w.cross(d_W) - V_WT.v, V_WH.w - V_WT.w};
}

Wrench SpringDamper::wrench_on_tool_W(const CouplingState& state) const noexcept {
  const CouplingParameters& c = parameters_;
  const Vec3 force = c.stiffness_n_per_m * state.d_W + c.damping_n_s_per_m * state.v_W;
  const Vec3 torque = c.stiffness_n_m_per_rad * state.theta_W + c.damping_n_m_s_per_rad * state.w_W;
  return {clamped_to_length(force, c.force_limit_n), clamped_to_length(torque, c.torque_limit_n_m)};
}

CouplingGradient SpringDamper::gradient(const CouplingState& state) const noexcept {
  const CouplingParameters& c = parameters_;
  const Vec3 force = c.stiffness_n_per_m * state.d_W + c.damping_n_s_per_m * state.v_W;
  const Vec3 torque = c.stiffness_n_m_per_rad * state.theta_W + c.damping_n_m_s_per_rad * state.w_W;
  const Eigen::Matrix3d of_force = clamp_derivative(force, c.force_limit_n);
  const Eigen::Matrix3d of_torque = clamp_derivative(torque, c.torque_limit_n_m);
  return {c.stiffness_n_per_m * of_force, c.damping_n_s_per_m * of_force, c.stiffness_n_m_per_rad * of_torque,
          c.damping_n_m_s_per_rad * of_torque};
}

CouplingWrenches coupling_wrenches(const CouplingLaw& law, const Pose& X_WH, const Twist& V_WH, const Pose& X_WT,
                                   const Twist& V_WT) noexcept {
  const CouplingState state = coupling_state(X_WH, V_WH, X_WT, V_WT);
  const Wrench on_tool = law.wrench_on_tool_W(state);
  return {on_tool, reaction_on_hand(on_tool, state.d_W)};
}

std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters) {
  if (name.empty() || name == "spring-damper") return std::make_unique<SpringDamper>(parameters);
  return nullptr;
}

}  // namespace tandem
