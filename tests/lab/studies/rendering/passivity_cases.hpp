// The region in which laws that are marked as passive must be passive: every device profile, with light and heavy
// tools.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "common/haptics/coupling/laws.hpp"
#include "devices/device_profile.hpp"
#include "tests/lab/studies/rendering/passivity_probe.hpp"

namespace tandem::lab {

inline constexpr std::array kToolMasses_kg{0.02, 0.2, 2.0};
/// Tested stiffness values, as fractions of the largest stiffness that the device can display.
inline constexpr std::array kStiffnessShares{0.05, 0.25, 0.5, 1.0};
/// Damping values as multiples of k·T (stiffness times period). k·T is the smallest damping that dissipates the energy
/// which sampling generates. The value 0 stands for the default damping of a scene.
inline constexpr std::array kDampings{1.0, 2.0, 0.0};
/// Upper bound for the energy created from the start of a run up to any later time.
inline constexpr double kMaxCreated_j = 10e-6;

/// Returns a coupling with the fraction `share` of the stiffness that the device can display. It includes rotation if
/// the device displays torque.
/// In      damping  one of kDampings
inline haptics::CouplingParameters coupling_on(const devices::DeviceProfile& profile, double share, double damping) {
  haptics::CouplingParameters c;
  c.stiffness_n_per_m = share * profile.stiffness_maximum_n_per_m.value;
  if (profile.has_torque()) c.stiffness_n_m_per_rad = share * profile.stiffness_maximum_n_m_per_rad.value;
  if (damping == 0) return c;
  c.damping_n_s_per_m = damping * c.stiffness_n_per_m / profile.rate_hz;
  c.damping_n_m_s_per_rad = damping * c.stiffness_n_m_per_rad / profile.rate_hz;
  return c;
}

inline HandRigSettings rig_on(std::string_view law, const devices::DeviceProfile& profile,
                              const haptics::CouplingParameters& coupling, double mass_kg) {
  HandRigSettings settings;
  settings.law = law;
  settings.rate_hz = profile.rate_hz;
  settings.coupling = coupling;
  settings.tool_mass_kg = mass_kg;
  // Inertia of a solid ball with a diameter of 5 cm.
  settings.tool_inertia_kg_m2 = Vec3::Constant(0.4 * mass_kg * 0.025 * 0.025);
  settings.plane_z_m = -0.002;
  return settings;
}

/// Removes the encoder steps: positions are exact, and velocities are differences of exact positions.
inline void make_exact(devices::HandParameters& hand) {
  hand.encoder_step_m = hand.encoder_step_rad = 0;
}

inline std::string described(const HandRigSettings& settings, std::string_view device, std::uint64_t seed) {
  const haptics::CouplingParameters& c = settings.coupling;
  return settings.law + " on " + std::string(device) + ", " + std::to_string(c.stiffness_n_per_m) + " N/m, " +
         std::to_string(c.damping_n_s_per_m) + " N·s/m, " + std::to_string(c.stiffness_n_m_per_rad) + " N·m/rad, " +
         std::to_string(c.damping_n_m_s_per_rad) + " N·m·s/rad, tool " + std::to_string(settings.tool_mass_kg) +
         " kg, seed " + std::to_string(seed);
}

}  // namespace tandem::lab
