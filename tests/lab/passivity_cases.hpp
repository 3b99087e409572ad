// The region in which laws that are called passive have to be: every device profile, light and heavy tools.
#pragma once

#include <array>
#include <string>

#include "common/coupling/laws.hpp"
#include "common/coupling/stability.hpp"
#include "devices/device_profile.hpp"
#include "tests/lab/passivity_probe.hpp"

namespace tandem::lab {

inline constexpr std::array kToolMasses_kg{0.02, 0.2, 2.0};
/// What may be missing at any time.
inline constexpr double kAllowance_j = 10e-6;

inline HandParameters hand_of(const CheckedHand& checked) {
  HandParameters hand;
  hand.mass_kg = checked.mass_kg;
  hand.damping_n_s_per_m = checked.damping_n_s_per_m;
  hand.stiffness_n_per_m = checked.stiffness_n_per_m;
  hand.inertia_kg_m2 = checked.inertia_kg_m2;
  hand.damping_n_m_s_per_rad = checked.damping_n_m_s_per_rad;
  hand.stiffness_n_m_per_rad = checked.stiffness_n_m_per_rad;
  return hand;
}

/// Its stiffness, `share` of the most that the device can show, with b = k T: the least damping that pays for sampling.
inline HandRigSettings passive_rig(std::string_view law, const DeviceProfile& profile, double share, double mass_kg) {
  HandRigSettings settings;
  settings.law = law;
  settings.rate_hz = profile.rate_hz;
  settings.coupling.stiffness_n_per_m = share * profile.stiffness_maximum_n_per_m.value;
  settings.coupling.damping_n_s_per_m = settings.coupling.stiffness_n_per_m / profile.rate_hz;
  settings.tool_mass_kg = mass_kg;
  // Of a solid ball of 5 cm.
  settings.tool_inertia_kg_m2 = Vec3::Constant(0.4 * mass_kg * 0.025 * 0.025);
  settings.plane_z_m = -0.002;
  return settings;
}

inline std::string described(const HandRigSettings& settings, std::string_view device, std::uint64_t seed) {
  return settings.law + " on " + std::string(device) + ", " + std::to_string(settings.coupling.stiffness_n_per_m) +
         " N/m, tool " + std::to_string(settings.tool_mass_kg) + " kg, seed " + std::to_string(seed);
}

}  // namespace tandem::lab
