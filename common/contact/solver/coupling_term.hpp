// A user's virtual coupling in the contact solver. It is evaluated implicitly: at the body's pose at the end of the
// step.
#pragma once

#include "common/contact/solver/block_cholesky.hpp"
#include "common/contact/solver/solver_types.hpp"

namespace tandem::contact {

/// The coupling of one step as a function of the body's twist.
///
/// Model   The tool T is fixed to the body, whose centre of mass is C. Symbols:
///         h      step
///         v, ω   velocity of C and angular velocity of the body: the arguments of evaluate()
///         r, r'  lever from C to T at the start and at the end of the step, r' = exp(h ω) r
///         d, θ   displacement and rotation of the tool relative to the handle H
///         f, τ   force and torque of the coupling about T
///         K, B   stiffness and damping of the law; K_d, B_v for translation, K_θ, B_ω for rotation
///         1. At the end of the step, p_WT = p_WC + h v + r' and v_WT = v + ω × r'.
///         2. The handle keeps its last received pose and velocity, since its motion during the step is not known yet.
///         3. The wrench about C is (f, τ + r' × f).
///         4. Its derivative is −Tᵀ (h K_d + B_v) T with T = [1, −[r']×] for the translation, and −(h K_θ + B_ω) for
///            the rotation.
///         The derivative omits the rotation of r' and of the rotation vector, because they make the matrix unsymmetric
///         or indefinite. The wrench is nevertheless exact. Because of the omission, the iteration may not converge,
///         for example if a hand's pose jumps by a radian. linearise() is used in this case
class CouplingTerm {
 public:
  CouplingTerm() = default;
  CouplingTerm(const SolverCoupling& coupling, const SolverBody& body, double step_s);

  /// Returns the wrench on the body, about its centre of mass at the end of the step.
  Wrench evaluate(const Twist& V_WC) noexcept;
  /// Returns −∂wrench/∂V_WC at the twist of the last evaluate().
  Mat6 derivative() const noexcept;
  /// Replaces the law by its wrench and derivative at `V_WC`, for all later evaluations of this step.
  void linearise(const Twist& V_WC) noexcept;
  /// Returns the wrench of the last evaluation, about the tool's origin.
  const Wrench& on_tool_W() const { return on_tool_W_; }

 private:
  const haptics::CouplingLaw* law_ = nullptr;
  double brake_n_s_per_m_ = 0;
  double brake_n_m_s_per_rad_ = 0;
  Pose X_WH_;
  Twist V_WH_;
  Quat q_WT_ = Quat::Identity();
  Vec3 p_WC_ = Vec3::Zero();
  Vec3 r_W_ = Vec3::Zero();  ///< vector from C to the tool's origin at the start of the step
  double step_s_ = 0;

  Vec3 lever_W_ = Vec3::Zero();  ///< vector from C to the tool's origin at the end of the step, r'
  haptics::CouplingState state_;
  Wrench on_tool_W_;

  bool is_linear_ = false;
  Vec6 at_ = Vec6::Zero();
  Vec6 wrench_ = Vec6::Zero();
  Mat6 derivative_ = Mat6::Zero();
};

}  // namespace tandem::contact
