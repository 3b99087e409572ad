#include "common/haptics/coupling/adaptive.hpp"

#include <algorithm>

namespace tandem::haptics {

CouplingParameters adapted(const AdaptiveFit& fit, double mass_kg, double inertia_kg_m2,
                           const CouplingParameters& base) noexcept {
  CouplingParameters result = base;
  result.stiffness_n_per_m = fit.stiffness_n_per_m(std::clamp(mass_kg, fit.mass_low_kg, fit.mass_high_kg));
  result.damping_n_s_per_m = fit.damping_n_s_per_m(result.stiffness_n_per_m);
  if (fit.inertia_high_kg_m2 > 0) {
    const double inertia = std::clamp(inertia_kg_m2, fit.inertia_low_kg_m2, fit.inertia_high_kg_m2);
    result.stiffness_n_m_per_rad = fit.stiffness_n_m_per_rad(inertia);
    result.damping_n_m_s_per_rad = fit.damping_n_m_s_per_rad(result.stiffness_n_m_per_rad);
  }
  return result;
}

AdaptiveFit thesis_adaptive_fit() noexcept {
  AdaptiveFit fit;
  fit.mass_low_kg = 0.05;
  fit.mass_high_kg = 0.2;
  fit.stiffness_n_per_m.c = {16.21, 116.53, 0, 0};
  fit.damping_n_s_per_m.c = {0.2, 0, 0, 0};
  return fit;
}

}  // namespace tandem::haptics
