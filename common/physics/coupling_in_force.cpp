#include "common/physics/coupling_in_force.hpp"

#include <algorithm>

#include "common/haptics/coupling/coupling_ranges.hpp"

namespace tandem::physics {

namespace {

bool is_adaptive(const SceneCoupling& coupling) noexcept {
  return coupling.fit.has_value() && coupling.law == haptics::kAdaptiveLaw;
}

}  // namespace

haptics::CouplingParameters coupling_in_force(const SceneCoupling& coupling, const MovedMass& moved) noexcept {
  haptics::CouplingParameters result = coupling.parameters;
  if (is_adaptive(coupling)) {
    result = haptics::adapted(*coupling.fit, moved.mass_kg, moved.inertia_kg_m2, coupling.parameters);
    // An adaptive fit is a cubic that was checked only at sample points. Between these points the coefficients may
    // leave the allowed range, so they are clamped.
    for (const haptics::CouplingRange& range : haptics::kCouplingRanges) {
      if (is_chosen_by_law(coupling, range.value)) {
        result.*range.value = std::clamp(result.*range.value, range.low, range.high);
      }
    }
  }
  if (coupling.dynamics == haptics::ToolDynamics::kMassless && !moved.is_held_body) {
    result.damping_n_s_per_m = result.damping_n_m_s_per_rad = 0;
  }
  return result;
}

bool is_chosen_by_law(const SceneCoupling& coupling, double haptics::CouplingParameters::*coefficient) noexcept {
  if (!is_adaptive(coupling)) return false;
  using C = haptics::CouplingParameters;
  const bool is_linear = coefficient == &C::stiffness_n_per_m || coefficient == &C::damping_n_s_per_m;
  const bool is_angular = coefficient == &C::stiffness_n_m_per_rad || coefficient == &C::damping_n_m_s_per_rad;
  return is_linear || (is_angular && coupling.fit->inertia_high_kg_m2 > 0);
}

}  // namespace tandem::physics
