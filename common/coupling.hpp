// Virtual coupling: the spring between what the hand holds (the device handle H) and what touches the
// world (the tool T). Both ends of the network use the same law: the server to pull the tool to the
// delayed handle, the client to pull the handle to the delayed tool.
#pragma once

#include <memory>
#include <string_view>

#include "common/spatial.hpp"

namespace tandem {

/// Where the handle is, seen from the tool; everything expressed in W.
struct CouplingState {
  Vec3 d_W = Vec3::Zero();      ///< p_WH − p_WT [m]
  Vec3 theta_W = Vec3::Zero();  ///< rotation vector that turns T onto H, the short way [rad]
  Vec3 v_W = Vec3::Zero();  ///< v_WH − w_WH × d − v_WT: of the handle's point that is at T, past the tool [m/s]
  Vec3 w_W = Vec3::Zero();  ///< w_WH − w_WT [rad/s]
};

CouplingState coupling_state(const Pose& X_WH, const Twist& V_WH, const Pose& X_WT, const Twist& V_WT);

/// Coefficients shared by the laws; limits act on the whole wrench, on hand and tool alike.
struct CouplingParameters {
  double stiffness_n_per_m = 300.0;
  double damping_n_s_per_m = 3.0;
  double stiffness_n_m_per_rad = 0.3;
  double damping_n_m_s_per_rad = 0.003;
  double force_limit_n = 6.5;     ///< magnitude at which the coupling force stops growing
  double torque_limit_n_m = 0.3;  ///< magnitude at which the coupling torque stops growing

  bool operator==(const CouplingParameters&) const = default;
};

/// How the wrench on the tool follows the state, in blocks; each is symmetric and has no negative eigenvalue.
struct CouplingGradient {
  Eigen::Matrix3d force_by_d = Eigen::Matrix3d::Zero();       ///< ∂f/∂d [N/m]
  Eigen::Matrix3d force_by_v = Eigen::Matrix3d::Zero();       ///< ∂f/∂v [N·s/m]
  Eigen::Matrix3d torque_by_theta = Eigen::Matrix3d::Zero();  ///< ∂τ/∂θ [N·m/rad]
  Eigen::Matrix3d torque_by_w = Eigen::Matrix3d::Zero();      ///< ∂τ/∂ω [N·m·s/rad]
};

/// A coupling law gives the wrench on the tool, about the tool's origin; for the hand's see coupling_wrenches().
///
/// Thread  haptic and room: no allocation, no throw, output finite for finite input
class CouplingLaw {
 public:
  virtual ~CouplingLaw() = default;
  virtual std::string_view name() const noexcept = 0;
  virtual void set_parameters(const CouplingParameters& parameters) noexcept = 0;
  virtual Wrench wrench_on_tool_W(const CouplingState& state) const noexcept = 0;
  /// Of wrench_on_tool_W(): what an implicit step needs. Zero for an input that is not finite.
  virtual CouplingGradient gradient(const CouplingState& state) const noexcept = 0;
};

/// Linear spring and damper, clamped to the limits with the direction kept.
///
/// Model   f = k_t d + b_t (v_H − v_T);  τ = k_r θ + b_r (ω_H − ω_T);  |f| ≤ F_max, |τ| ≤ T_max.
///         Gradient beyond the limit, with u the unlimited force: F_max/|u| (I − ûûᵀ) times k_t and b_t, and alike for
///         τ
/// Source  McNeely, Puterbaugh, Troy, "Six degree-of-freedom haptic rendering using voxel sampling",
///         SIGGRAPH 1999; the clamp is ours: acting on both ends, it creates no energy.
class SpringDamper final : public CouplingLaw {
 public:
  explicit SpringDamper(const CouplingParameters& parameters) : parameters_(parameters) {}
  std::string_view name() const noexcept override { return "spring-damper"; }
  void set_parameters(const CouplingParameters& parameters) noexcept override { parameters_ = parameters; }
  Wrench wrench_on_tool_W(const CouplingState& state) const noexcept override;
  CouplingGradient gradient(const CouplingState& state) const noexcept override;

 private:
  CouplingParameters parameters_;
};

/// What the coupling does to its two ends.
struct CouplingWrenches {
  Wrench on_tool_W;  ///< about the tool's origin
  Wrench on_hand_W;  ///< about the handle's origin
};

/// What a coupling's wrench on the tool does to the hand, `d_W` from the tool's origin to the handle's.
inline Wrench reaction_on_hand(const Wrench& on_tool_W, const Vec3& d_W) noexcept {
  return {-on_tool_W.f, d_W.cross(on_tool_W.f) - on_tool_W.t};
}

/// Both ends of `law`, one the reaction of the other: their forces and their moments about any one point sum to zero.
///
/// Model   on tool (f, τ) about T, on hand (−f, −τ + d × f) about H. The power of both,
///         f·v_T + τ·ω_T − f·v_H − (τ − d × f)·ω_H = −f·(v_H − ω_H × d − v_T) − τ·(ω_H − ω_T),
///         is −f·v − τ·ω with CouplingState's v, ω: what a spring and damper store and dissipate, no more
/// Source  our derivation. The lever is on the hand's side: only the coupling's torque turns the tool, wherever the
///         handle is.
CouplingWrenches coupling_wrenches(const CouplingLaw& law, const Pose& X_WH, const Twist& V_WH, const Pose& X_WT,
                                   const Twist& V_WT) noexcept;

/// The law called `name`, or null when there is none of that name ("" means "spring-damper").
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);

}  // namespace tandem
