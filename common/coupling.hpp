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
  Vec3 v_W = Vec3::Zero();      ///< v_WH − v_WT [m/s]
  Vec3 w_W = Vec3::Zero();      ///< w_WH − w_WT [rad/s]
};

CouplingState coupling_state(const Pose& X_WH, const Twist& V_WH, const Pose& X_WT, const Twist& V_WT);

/// Coefficients shared by the laws; limits act on the whole wrench, on hand and tool alike.
struct CouplingParameters {
  double stiffness_n_per_m = 300.0;
  double damping_n_s_per_m = 3.0;
  double stiffness_n_m_per_rad = 0.3;
  double damping_n_m_s_per_rad = 0.003;
  double force_limit_n = 6.5;      ///< magnitude at which the coupling force stops growing
  double torque_limit_n_m = 0.3;   ///< magnitude at which the coupling torque stops growing
};

/// A coupling law gives the wrench on the tool, about the tool's origin; the hand feels its negative.
///
/// Thread  haptic and room: no allocation, no throw, output finite for finite input
class CouplingLaw {
 public:
  virtual ~CouplingLaw() = default;
  virtual std::string_view name() const noexcept = 0;
  virtual void set_parameters(const CouplingParameters& parameters) noexcept = 0;
  virtual Wrench wrench_on_tool_W(const CouplingState& state) const noexcept = 0;
};

/// Linear spring and damper, clamped to the limits with the direction kept.
///
/// Model   f = k_t d + b_t (v_H − v_T);  τ = k_r θ + b_r (ω_H − ω_T);  |f| ≤ F_max, |τ| ≤ T_max
/// Source  McNeely, Puterbaugh, Troy, "Six degree-of-freedom haptic rendering using voxel sampling",
///         SIGGRAPH 1999; the clamp is ours: acting on both ends, it creates no energy.
class SpringDamper final : public CouplingLaw {
 public:
  explicit SpringDamper(const CouplingParameters& parameters) : parameters_(parameters) {}
  std::string_view name() const noexcept override { return "spring-damper"; }
  void set_parameters(const CouplingParameters& parameters) noexcept override { parameters_ = parameters; }
  Wrench wrench_on_tool_W(const CouplingState& state) const noexcept override;

 private:
  CouplingParameters parameters_;
};

/// The law called `name`, or null when there is none of that name ("" means "spring-damper").
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);

}  // namespace tandem
