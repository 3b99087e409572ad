#include "devices/device_check.hpp"

namespace tandem {
namespace {

/// Periods that are left of the velocity estimator's adaptive window once an oscillation is felt: at 30 Hz and 20 steps
/// wide a line fits to within a step over √(12 step / acceleration) = 4 ms. Smaller ones are a buzz that does not grow.
constexpr int kWindowOfSteps = 4;

}  // namespace

LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace) {
  LoopDevice device;
  device.mass_kg = profile.apparent_mass_kg.value;
  device.damping_n_s_per_m = profile.physical_damping_n_s_per_m.value;
  device.has_torque = profile.has_torque();
  device.inertia_kg_m2 = profile.apparent_inertia_kg_m2.value;
  device.damping_n_m_s_per_rad = profile.physical_damping_n_m_s_per_rad.value;
  device.period_s = 1 / profile.rate_hz;
  device.velocity_window = profile.position_step_m.value > 0 ? kWindowOfSteps : 1;
  device.coupling_scale = workspace.force_scale * workspace.position_scale;
  device.rotational_coupling_scale = workspace.hand_joules_per_world_joule();
  return device;
}

}  // namespace tandem
