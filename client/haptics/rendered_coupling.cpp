#include "client/haptics/rendered_coupling.hpp"

#include <algorithm>

#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {
namespace {

haptics::CouplingParameters in_world(const haptics::CouplingParameters& bounds, const WorkspaceMapping& map) noexcept {
  const double linear = map.force_scale * map.position_scale;  // f_D / f_W for each p_W / p_D
  const double angular = map.hand_joules_per_world_joule();
  haptics::CouplingParameters result = bounds;
  result.stiffness_n_per_m /= linear;
  result.damping_n_s_per_m /= linear;
  result.force_limit_n /= map.force_scale;
  result.stiffness_n_m_per_rad /= angular;
  result.damping_n_m_s_per_rad /= angular;
  result.torque_limit_n_m /= angular;
  return result;
}

}  // namespace

haptics::CouplingParameters rendered_coupling(std::string_view law, const haptics::CouplingParameters& asked,
                                              const haptics::CouplingParameters& device_bounds,
                                              const WorkspaceMapping& workspace) noexcept {
  const haptics::CouplingParameters bounds = in_world(device_bounds, workspace);
  haptics::CouplingParameters result;
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    result.*field.value = std::min(asked.*field.value, bounds.*field.value);
  }
  const double steepest = std::max(1.0, haptics::steepest_slope_factor(law, result));
  result.stiffness_n_per_m = std::min(asked.stiffness_n_per_m, bounds.stiffness_n_per_m / steepest);
  result.stiffness_n_m_per_rad = std::min(asked.stiffness_n_m_per_rad, bounds.stiffness_n_m_per_rad / steepest);
  return result;
}

}  // namespace tandem::client
