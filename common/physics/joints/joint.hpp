// Springs and dampers that are not a hand's: what joins a thing to its copy elsewhere, or a body to where it started.
#pragma once

#include <cmath>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::physics {

/// Spring and damper between two frames, translation and rotation apart, without a limit.
///
/// Model   f = k_t d + b_t v, τ = k_r θ + b_r ω, letters as in CouplingState; along `axis` the translational ones are
///         axis_stiffness and axis_damping instead: f = k_t d + (k_a − k_t) (n·d) n and so on
struct Joint {
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double stiffness_n_m_per_rad = 0;
  double damping_n_m_s_per_rad = 0;
  Vec3 axis_W = Vec3::Zero();  ///< n, unit; zero: the same in every direction
  double axis_stiffness_n_per_m = 0;
  double axis_damping_n_s_per_m = 0;

  bool operator==(const Joint&) const = default;
};

/// Whether arithmetic with it is sound.
inline bool is_usable(const Joint& joint) noexcept {
  const auto is_sound = [](double value) { return std::isfinite(value) && value >= 0; };
  return is_sound(joint.stiffness_n_per_m) && is_sound(joint.damping_n_s_per_m) &&
         is_sound(joint.stiffness_n_m_per_rad) && is_sound(joint.damping_n_m_s_per_rad) &&
         is_sound(joint.axis_stiffness_n_per_m) && is_sound(joint.axis_damping_n_s_per_m) && is_finite(joint.axis_W) &&
         joint.axis_W.norm() < 1 + 1e-6;
}

/// What a spring of `across` in all directions and `along` in that of `axis` makes of a displacement or a velocity.
inline Vec3 along_and_across(const Vec3& axis, double along, double across, const Vec3& way) noexcept {
  return across * way + (along - across) * axis.dot(way) * axis;
}

/// ½ dᵀ K_t d + ½ k_r θ² of a body at `X` that is joined to `X_target`.
inline double stored_energy_j(const Joint& joint, const Pose& X_target, const Pose& X) noexcept {
  const Vec3 d = X_target.p - X.p;
  const Vec3 force = along_and_across(joint.axis_W, joint.axis_stiffness_n_per_m, joint.stiffness_n_per_m, d);
  return 0.5 * d.dot(force) +
         0.5 * joint.stiffness_n_m_per_rad * rotation_vector(X_target.q * X.q.conjugate()).squaredNorm();
}

/// A share of a joint as the implicit solver wants it: linear and without a bend, so that it is as stiff as it says.
class JointLaw final : public haptics::CouplingLaw {
 public:
  void set(const Joint& joint, double share) noexcept {
    joint_ = joint;
    for (double Joint::*const number :
         {&Joint::stiffness_n_per_m, &Joint::damping_n_s_per_m, &Joint::stiffness_n_m_per_rad,
          &Joint::damping_n_m_s_per_rad, &Joint::axis_stiffness_n_per_m, &Joint::axis_damping_n_s_per_m}) {
      joint_.*number *= share;
    }
  }
  const Joint& joint() const noexcept { return joint_; }

  std::string_view name() const noexcept override { return "joint"; }
  void set_parameters(const haptics::CouplingParameters& parameters) noexcept override {
    joint_ = {parameters.stiffness_n_per_m, parameters.damping_n_s_per_m, parameters.stiffness_n_m_per_rad,
              parameters.damping_n_m_s_per_rad};
  }
  Wrench wrench_on_tool_W(const haptics::CouplingState& state) const noexcept override {
    const Joint& j = joint_;
    return {along_and_across(j.axis_W, j.axis_stiffness_n_per_m, j.stiffness_n_per_m, state.d_W) +
                along_and_across(j.axis_W, j.axis_damping_n_s_per_m, j.damping_n_s_per_m, state.v_W),
            j.stiffness_n_m_per_rad * state.theta_W + j.damping_n_m_s_per_rad * state.w_W};
  }
  haptics::CouplingGradient gradient(const haptics::CouplingState& /*state*/) const noexcept override {
    const Joint& j = joint_;
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d axis = j.axis_W * j.axis_W.transpose();
    return {j.stiffness_n_per_m * one + (j.axis_stiffness_n_per_m - j.stiffness_n_per_m) * axis,
            j.damping_n_s_per_m * one + (j.axis_damping_n_s_per_m - j.damping_n_s_per_m) * axis,
            j.stiffness_n_m_per_rad * one, j.damping_n_m_s_per_rad * one};
  }

 private:
  Joint joint_;
};

}  // namespace tandem::physics
