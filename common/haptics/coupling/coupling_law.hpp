// Virtual coupling: spring and damper between the device handle (H) and the tool (T) that touches the world. The same
// law acts at both ends of the network. At the server, it pulls the tool to the delayed handle; at the client, it pulls
// the handle to the delayed tool.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Displacement and velocity of the handle relative to the tool, expressed in W.
struct CouplingState {
  Vec3 d_W = Vec3::Zero();      ///< p_WH − p_WT [m]
  Vec3 theta_W = Vec3::Zero();  ///< rotation vector of the shortest rotation from T to H [rad]
  Vec3 v_W = Vec3::Zero();      ///< v_WH − w_WH × d − v_WT [m/s]: velocity of the handle's point at T, minus T's
  Vec3 w_W = Vec3::Zero();      ///< w_WH − w_WT [rad/s]
  Vec3 v_WH = Vec3::Zero();     ///< velocity of the handle [m/s]; shows whether the handle pushes or recedes
  Vec3 w_WH = Vec3::Zero();     ///< angular velocity of the handle [rad/s]
};

CouplingState coupling_state(const Pose& X_WH, const Twist& V_WH, const Pose& X_WT, const Twist& V_WT);

/// Coefficients that all laws use. The limits apply to the total wrench, on the hand and on the tool alike.
struct CouplingParameters {
  double stiffness_n_per_m = 300.0;  ///< k_t: stiffness of linear laws; curved laws bend at d_max = F_max / k_t
  double damping_n_s_per_m = 3.0;
  double stiffness_n_m_per_rad = 0.3;
  double damping_n_m_s_per_rad = 0.003;
  double force_limit_n = 6.5;     ///< F_max: upper bound of the coupling force's magnitude
  double torque_limit_n_m = 0.3;  ///< T_max: upper bound of the coupling torque's magnitude
  /// ε of saturated(): the force bends in the last part of its range, from (1 − ε) F_max to F_max. 0 gives a corner.
  double saturation_softness = 0.2;
  double curve_sharpness = 1.0;  ///< c of the stable-dynamic curve (laws.cpp), 0.1 to 10

  bool operator==(const CouplingParameters&) const = default;
};

/// Derivatives of the wrench on the tool with respect to CouplingState. Each matrix is symmetric and positive
/// semidefinite. The other derivatives (force by rotation, torque by displacement) are zero.
struct CouplingGradient {
  Eigen::Matrix3d force_by_d = Eigen::Matrix3d::Zero();       ///< ∂f/∂d [N/m]
  Eigen::Matrix3d force_by_v = Eigen::Matrix3d::Zero();       ///< ∂f/∂v [N·s/m]
  Eigen::Matrix3d torque_by_theta = Eigen::Matrix3d::Zero();  ///< ∂τ/∂θ [N·m/rad]
  Eigen::Matrix3d torque_by_w = Eigen::Matrix3d::Zero();      ///< ∂τ/∂ω [N·m·s/rad]
};

/// Kind of tool for which a law is made.
enum class ToolDynamics : std::uint8_t {
  kWithMass,  ///< a rigid body with mass, weight and velocity
  kMassless,  ///< no mass and no weight: in each step the tool is at equilibrium between coupling and contact
  kAtHandle,  ///< the tool is at the handle; the contact wrench is displayed directly
};

/// Coupling law: computes the wrench on the tool, about the tool's origin. coupling_wrenches() also returns the wrench
/// on the hand. laws.hpp lists all laws and states for each whether it is passive.
///
/// Thread  haptic and room: no allocation, no throw, output finite for any input
class CouplingLaw {
 public:
  virtual ~CouplingLaw() = default;
  virtual std::string_view name() const noexcept = 0;
  virtual void set_parameters(const CouplingParameters& parameters) noexcept = 0;
  virtual Wrench wrench_on_tool_W(const CouplingState& state) const noexcept = 0;
  /// Returns the gradient of wrench_on_tool_W() for an implicit step. The gradient is exact in three cases: below the
  /// knee of the saturation, for a linear law, and where spring force and damper force are parallel. Otherwise ∂f/∂d is
  /// an approximation, a symmetric matrix with the eigenvalues of the exact one (RadialLaw in laws.cpp).
  ///
  /// Fails   returns zero for an input that is not finite
  virtual CouplingGradient gradient(const CouplingState& state) const noexcept = 0;
  virtual ToolDynamics tool_dynamics() const noexcept { return ToolDynamics::kWithMass; }
};

/// Wrenches of the coupling on its two ends.
struct CouplingWrenches {
  Wrench on_tool_W;  ///< about the tool's origin
  Wrench on_hand_W;  ///< about the handle's origin
};

/// Returns the wrench on the hand that belongs to a wrench of the coupling on the tool. `d_W` points from the tool's
/// origin to the handle's origin.
inline Wrench reaction_on_hand(const Wrench& on_tool_W, const Vec3& d_W) noexcept {
  return {-on_tool_W.f, d_W.cross(on_tool_W.f) - on_tool_W.t};
}

/// Returns the wrenches of `law` on both ends. Their forces sum to zero, and so do their moments about any one point.
///
/// Model   The wrench on the tool is (f, τ) about T, and that on the hand (−f, −τ + d × f) about H. With v and ω of
///         CouplingState, both wrenches together have the power −f·v − τ·ω. It is the negative of the power that spring
///         and damper store and dissipate:
///         f·v_T + τ·ω_T − f·v_H − (τ − d × f)·ω_H = −f·(v_H − ω_H × d − v_T) − τ·(ω_H − ω_T)
/// Source  our derivation. The handle's end of the lever d carries its moment, d × f. The tool is therefore turned by
///         the coupling's torque only, wherever the handle is
CouplingWrenches coupling_wrenches(const CouplingLaw& law, const Pose& X_WH, const Twist& V_WH, const Pose& X_WT,
                                   const Twist& V_WT) noexcept;

}  // namespace tandem::haptics
