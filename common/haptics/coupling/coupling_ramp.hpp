// Ramp of a coupling's coefficients, so that a change while the coupling is stretched causes no step of force. Server
// and client use the same ramp, so both ends of the coupling agree except for the delay.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Shortest duration of a change of coefficients. Our choice: at most the time that a user needs to notice that the
/// tool has grasped a body.
inline constexpr double kCouplingRamp_s = 0.1;
/// Longest duration of a change. The limit is needed because a change from or to a coupling that is almost zero would
/// otherwise take very long.
inline constexpr double kMaxCouplingRamp_s = 1;
/// Largest rate at which a change of coefficients changes the force, at any displacement. Our choice: users feel a
/// change of less than 0.1 N/ms as smooth.
inline constexpr double kRampSlope_n_per_s = 80;

/// Coupling coefficients that move to a target.
///
/// Model   A coefficient changes from c₀ to c₁ in the time T. Let s = min(1, t / T) be the progress.
///         1. In general: linear, c(t) = c₀ + (c₁ − c₀) s with T = 100 ms.
///         2. Stiffness and damping, if the stiffness changes much: geometric, c(t) = c₀ (c₁ / c₀)^s with T = F ln(r) /
///            kRampSlope_n_per_s. F is the force limit, and r the ratio of the larger to the smaller stiffness.
///         Reason for the second case: the force k d is at most F, so the displacement d is at most F divided by the
///         smaller stiffness. A linear change would therefore change the force at a rate of up to F (r − 1) / T. If
///         this rate exceeds kRampSlope_n_per_s, stiffness and damping change geometrically; the rate is then k d ln(r)
///         / T, at most kRampSlope_n_per_s unless T is clamped to kMaxCouplingRamp_s.
///         Energy: an increase Δk of the stiffness at a displacement d adds the energy ½ Δk d². The change of the
///         coefficients creates this energy, not the law
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
    choose_duration();
  }
  /// Advances the ramp by one step. Returns false if the coefficients did not change.
  bool advance(double step_s) noexcept;

  const CouplingParameters& now() const noexcept { return now_; }
  /// Coefficients at the end of the ramp.
  const CouplingParameters& target() const noexcept { return to_; }

 private:
  void choose_duration() noexcept;

  CouplingParameters from_;
  CouplingParameters to_;
  CouplingParameters now_;
  double part_ = 1;  ///< progress from `from_` to `to_`, 0 to 1
  double duration_s_ = kCouplingRamp_s;
  bool is_geometric_ = false;
};

inline void CouplingRamp::choose_duration() noexcept {
  constexpr double kLeast_n_per_m = 1;
  const double low = std::max(kLeast_n_per_m, std::min(from_.stiffness_n_per_m, to_.stiffness_n_per_m));
  const double ratio = std::max(from_.stiffness_n_per_m, to_.stiffness_n_per_m) / low;
  const double force_n = std::max(from_.force_limit_n, to_.force_limit_n);
  const double limit_s = std::abs(to_.force_limit_n - from_.force_limit_n) / kRampSlope_n_per_s;
  is_geometric_ = force_n * (ratio - 1) > kRampSlope_n_per_s * kCouplingRamp_s;
  const double stiffness_s = is_geometric_ ? force_n * std::log(ratio) / kRampSlope_n_per_s : 0;
  duration_s_ = std::clamp(std::max(limit_s, stiffness_s), kCouplingRamp_s, kMaxCouplingRamp_s);
}

inline bool CouplingRamp::advance(double step_s) noexcept {
  if (part_ >= 1) return false;
  part_ = std::min(1.0, part_ + std::max(0.0, step_s) / duration_s_);
  for (double CouplingParameters::*value :
       {&CouplingParameters::stiffness_n_per_m, &CouplingParameters::damping_n_s_per_m,
        &CouplingParameters::stiffness_n_m_per_rad, &CouplingParameters::damping_n_m_s_per_rad,
        &CouplingParameters::force_limit_n, &CouplingParameters::torque_limit_n_m,
        &CouplingParameters::saturation_softness, &CouplingParameters::curve_sharpness}) {
    now_.*value = from_.*value + part_ * (to_.*value - from_.*value);
  }
  if (is_geometric_) {
    for (double CouplingParameters::*value :
         {&CouplingParameters::stiffness_n_per_m, &CouplingParameters::damping_n_s_per_m}) {
      if (from_.*value > 0 && to_.*value > 0) now_.*value = from_.*value * std::pow(to_.*value / from_.*value, part_);
    }
  }
  if (part_ >= 1) now_ = to_;
  return true;
}

}  // namespace tandem::haptics
