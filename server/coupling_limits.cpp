#include "server/coupling_limits.hpp"

#include <algorithm>

namespace tandem {

CouplingParameters stable_coupling(const CouplingParameters& coupling, const CoupledInertia& pulled, double step_s) {
  const double inertia = pulled.inertia_kg_m2 / pulled.hands;
  const double mass = pulled.mass_kg / pulled.hands;
  CouplingParameters stable = coupling;
  stable.stiffness_n_per_m = std::min(coupling.stiffness_n_per_m, 0.5 * mass / (step_s * step_s));
  stable.damping_n_s_per_m = std::min(coupling.damping_n_s_per_m, 0.5 * mass / step_s);
  stable.stiffness_n_m_per_rad = std::min(coupling.stiffness_n_m_per_rad, 0.5 * inertia / (step_s * step_s));
  stable.damping_n_m_s_per_rad = std::min(coupling.damping_n_m_s_per_rad, 0.5 * inertia / step_s);
  return stable;
}

}  // namespace tandem
