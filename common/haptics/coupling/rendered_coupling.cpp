#include "common/haptics/coupling/rendered_coupling.hpp"

#include <algorithm>

#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {

CouplingParameters coupling_bounds_in_world(const CouplingParameters& device_bounds,
                                            const WorkspaceMapping& workspace) noexcept {
  const double linear = workspace.force_scale * workspace.position_scale;  // stiffness scale, world to device
  const double angular = workspace.hand_joules_per_world_joule();
  CouplingParameters result = device_bounds;
  result.stiffness_n_per_m /= linear;
  result.damping_n_s_per_m /= linear;
  result.force_limit_n /= workspace.force_scale;
  result.stiffness_n_m_per_rad /= angular;
  result.damping_n_m_s_per_rad /= angular;
  result.torque_limit_n_m /= angular;
  return result;
}

CouplingParameters rendered_coupling(std::string_view law, const CouplingParameters& requested,
                                     const CouplingParameters& bounds_W) noexcept {
  CouplingParameters result;
  for (const CouplingRange& range : kCouplingRanges) {
    result.*range.value = std::min(requested.*range.value, bounds_W.*range.value);
  }
  const double steepest = std::max(1.0, steepest_slope_factor(law, result));
  result.stiffness_n_per_m = std::min(requested.stiffness_n_per_m, bounds_W.stiffness_n_per_m / steepest);
  result.stiffness_n_m_per_rad = std::min(requested.stiffness_n_m_per_rad, bounds_W.stiffness_n_m_per_rad / steepest);
  return result;
}

}  // namespace tandem::haptics
