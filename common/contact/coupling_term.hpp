// A user's coupling as the contact solver sees it: taken at the end of the step, where the body will be.
#pragma once

#include "common/contact/block_cholesky.hpp"
#include "common/contact/contact_solver.hpp"

namespace tandem::contact {

/// The coupling of one step as a function of the body's twist.
///
/// Model   The tool T is fixed to the body: at the end of the step r' = exp(h ω) r, p_WT = p_WC + h v + r',
///         v_WT = v + ω × r'. Its wrench (f, τ) about T is (f, τ + r' × f) about C. The handle is where it was last
///         seen and keeps its velocity there: what it does during the step is not known yet. The derivative is −Tᵀ (h
///         K_d + B_v) T with T = [1, −[r']×], and −(h K_θ + B_ω) of the rotation. Left out, because no symmetric
///         positive matrix holds it: the turning of the lever r' and of the rotation vector. The wrench is exact all
///         the same. Where that does not converge, as when a hand's pose jumps by a radian, linearise() puts wrench and
///         derivative in the place of the law for the rest of the step.
class CouplingTerm {
 public:
  CouplingTerm() = default;
  CouplingTerm(const SolverCoupling& coupling, const SolverBody& body, double step_s);

  /// On the body, about its centre of mass at the end of the step.
  Wrench evaluate(const Twist& V_WC) noexcept;
  /// −∂wrench/∂V_WC where evaluate() was last asked.
  Mat6 derivative() const noexcept;
  /// From now on the wrench is linear in the twist, as it is now at `V_WC`.
  void linearise(const Twist& V_WC) noexcept;
  /// As last evaluated, about the tool's origin.
  const Wrench& on_tool_W() const { return on_tool_W_; }

 private:
  const haptics::CouplingLaw* law_ = nullptr;
  double brake_n_s_per_m_ = 0;
  double brake_n_m_s_per_rad_ = 0;
  Pose X_WH_;
  Twist V_WH_;
  Quat q_WT_ = Quat::Identity();
  Vec3 p_WC_ = Vec3::Zero();
  Vec3 r_W_ = Vec3::Zero();  ///< from C to the tool's origin
  double step_s_ = 0;

  Vec3 lever_W_ = Vec3::Zero();  ///< r'
  haptics::CouplingState state_;
  Wrench on_tool_W_;

  bool is_linear_ = false;
  Vec6 at_ = Vec6::Zero();
  Vec6 wrench_ = Vec6::Zero();
  Mat6 derivative_ = Mat6::Zero();
};

/// What turns b into a × b.
Eigen::Matrix3d cross_matrix(const Vec3& a);

}  // namespace tandem::contact
