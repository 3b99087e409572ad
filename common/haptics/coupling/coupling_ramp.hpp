// Ramp of a coupling's coefficients, so that a change while the coupling is stretched causes no step of force. Server
// and client use the same ramp, so both ends of the coupling agree except for the delay.
#pragma once

#include <algorithm>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Duration of a change of coefficients. It was chosen to be at most the time that a user needs to notice a grasp.
inline constexpr double kCouplingRamp_s = 0.1;

/// Coupling coefficients that move linearly in time to a target.
///
/// Model   c(t) = c₀ + (c₁ − c₀) min(1, t / 100 ms). An increase Δk of the stiffness at a displacement d adds the
///         energy ½ Δk d². This energy comes from the change of the coefficients, so the law itself stays passive
/// Thread  haptic and room: no allocation, no throw
class CouplingRamp {
 public:
  explicit CouplingRamp(const CouplingParameters& parameters) noexcept { jump_to(parameters); }

  void jump_to(const CouplingParameters& parameters) noexcept {
    from_ = to_ = now_ = parameters;
    part_ = 1;
  }
  void fade_to(const CouplingParameters& parameters) noexcept {
    if (parameters == to_) return;
    from_ = now_;
    to_ = parameters;
    part_ = 0;
  }
  /// Advances the ramp by one step. Returns false if the coefficients did not change.
  bool advance(double step_s) noexcept;

  const CouplingParameters& now() const noexcept { return now_; }
  /// Coefficients at the end of the ramp.
  const CouplingParameters& target() const noexcept { return to_; }

 private:
  CouplingParameters from_;
  CouplingParameters to_;
  CouplingParameters now_;
  double part_ = 1;  ///< progress from `from_` to `to_`, 0 to 1
};

inline bool CouplingRamp::advance(double step_s) noexcept {
  if (part_ >= 1) return false;
  part_ = std::min(1.0, part_ + std::max(0.0, step_s) / kCouplingRamp_s);
  for (double CouplingParameters::*value :
       {&CouplingParameters::stiffness_n_per_m, &CouplingParameters::damping_n_s_per_m,
        &CouplingParameters::stiffness_n_m_per_rad, &CouplingParameters::damping_n_m_s_per_rad,
        &CouplingParameters::force_limit_n, &CouplingParameters::torque_limit_n_m,
        &CouplingParameters::saturation_softness, &CouplingParameters::curve_sharpness}) {
    now_.*value = from_.*value + part_ * (to_.*value - from_.*value);
  }
  if (part_ >= 1) now_ = to_;
  return true;
}

}  // namespace tandem::haptics
