#include "devices/device_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/haptics/velocity_estimator.hpp"

namespace tandem::devices {
namespace {

/// Averaging time of the adaptive velocity estimator [s]. During an oscillation with acceleration a, the estimator can
/// fit a line to positions with encoder step s over the time √(12 s / a).
/// a is that of an oscillation of 30 Hz with an amplitude of 20 s, the smallest that a user can feel. Smaller
/// oscillations need not be considered: they are not felt, and they do not grow.
constexpr double kWindowOfSteps_s = 0.004;

int velocity_window(const SourcedLimit& step, double rate_hz) {
  if (!(step.value > 0)) return 1;
  const auto longest = static_cast<double>(haptics::VelocityEstimator::kWindow);
  return static_cast<int>(std::clamp(std::round(kWindowOfSteps_s * rate_hz), 1.0, longest));
}

}  // namespace

haptics::LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace) {
  haptics::LoopDevice device;
  device.mass_kg = profile.apparent_mass_kg.value;
  device.damping_n_s_per_m = profile.physical_damping_n_s_per_m.value;
  device.is_verified = is_verified(profile.apparent_mass_kg) && is_verified(profile.physical_damping_n_s_per_m);
  device.has_torque = profile.has_torque();
  device.inertia_kg_m2 = profile.apparent_inertia_kg_m2.value;
  device.damping_n_m_s_per_rad = profile.physical_damping_n_m_s_per_rad.value;
  device.is_rotation_verified =
      is_verified(profile.apparent_inertia_kg_m2) && is_verified(profile.physical_damping_n_m_s_per_rad);
  device.period_s = 1 / profile.rate_hz;
  device.velocity_window = velocity_window(profile.position_step_m, profile.rate_hz);
  device.rotational_velocity_window = velocity_window(profile.rotation_step_rad, profile.rate_hz);
  device.coupling_scale = workspace.force_scale * workspace.position_scale;
  device.rotational_coupling_scale = workspace.hand_joules_per_world_joule();
  return device;
}

LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                           double mass_kg, double inertia_kg_m2, bool is_held_body) {
  LoopCoupling loop{parameters, mass_kg, inertia_kg_m2, haptics::steepest_slope_factor(law.name, parameters)};
  if (law.tool == haptics::ToolDynamics::kMassless && !is_held_body) {
    loop.tool_mass_kg = loop.tool_inertia_kg_m2 = 0;
    loop.parameters.damping_n_s_per_m = loop.parameters.damping_n_m_s_per_rad = 0;
  } else if (law.tool == haptics::ToolDynamics::kAtHandle) {
    loop.parameters.stiffness_n_per_m = loop.parameters.stiffness_n_m_per_rad = 0;
    loop.parameters.damping_n_s_per_m = loop.parameters.damping_n_m_s_per_rad = 0;
  }
  return loop;
}

std::optional<haptics::StabilityFinding> find_active_law(const haptics::CouplingLawInfo& law) {
  if (law.is_passive) return std::nullopt;
  haptics::StabilityFinding finding;
  finding.verdict = haptics::StabilityVerdict::kNotPassive;
  finding.parameter = "coupling.law";
  finding.value = finding.rendered_value = finding.remedy = std::numeric_limits<double>::quiet_NaN();
  finding.text = "coupling.law is \"" + std::string(law.name) + "\": ";
  if (law.tool == haptics::ToolDynamics::kAtHandle) {
    finding.text +=
        "contact is closed through the network's delay, as stiff as it is, and no check of the device's loop covers "
        "that: expect kicks and ringing";
  } else {
    finding.text += "it can give the hand energy with any coefficients";
  }
  finding.text += "; \"" + std::string(haptics::kDefaultCouplingLaw) + "\" is passive";
  return finding;
}

}  // namespace tandem::devices
