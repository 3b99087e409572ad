// Springs and dampers of anchors. An anchor couples a body to its start pose, not to a hand.
#pragma once

#include <cmath>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::physics {

/// Spring and damper between two frames, separate for translation and rotation, without a force limit.
///
/// Model   f = k_t d + b_t v, τ = k_r θ + b_r ω, with the displacement d, velocity v, rotation θ and angular velocity ω
///         of CouplingState
struct Joint {
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double stiffness_n_m_per_rad = 0;
  double damping_n_m_s_per_rad = 0;

  bool operator==(const Joint&) const = default;
};

/// Returns the energy ½ k_t d² + ½ k_r θ² of a joint that pulls a body at the pose `X` to `X_target`.
inline double stored_energy_j(const Joint& joint, const Pose& X_target, const Pose& X) noexcept {
  return 0.5 * joint.stiffness_n_per_m * (X_target.p - X.p).squaredNorm() +
         0.5 * joint.stiffness_n_m_per_rad * rotation_vector(X_target.q * X.q.conjugate()).squaredNorm();
}

/// A joint in the form of a coupling law for the implicit solver. The law is linear and never saturates, so its
/// gradient is exact.
class JointLaw final : public haptics::CouplingLaw {
 public:
  void set(const Joint& joint) noexcept { joint_ = joint; }
  const Joint& joint() const noexcept { return joint_; }

  std::string_view name() const noexcept override { return "joint"; }
  void set_parameters(const haptics::CouplingParameters& parameters) noexcept override {
    joint_ = {parameters.stiffness_n_per_m, parameters.damping_n_s_per_m, parameters.stiffness_n_m_per_rad,
              parameters.damping_n_m_s_per_rad};
  }
  Wrench wrench_on_tool_W(const haptics::CouplingState& state) const noexcept override {
    return {joint_.stiffness_n_per_m * state.d_W + joint_.damping_n_s_per_m * state.v_W,
            joint_.stiffness_n_m_per_rad * state.theta_W + joint_.damping_n_m_s_per_rad * state.w_W};
  }
  haptics::CouplingGradient gradient(const haptics::CouplingState& /*state*/) const noexcept override {
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    return {joint_.stiffness_n_per_m * one, joint_.damping_n_s_per_m * one, joint_.stiffness_n_m_per_rad * one,
            joint_.damping_n_m_s_per_rad * one};
  }

 private:
  Joint joint_;
};

}  // namespace tandem::physics
