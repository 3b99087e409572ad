// Stability of a coupling law on a device: computes the inputs of the stability check
// (common/haptics/coupling/stability.hpp) from the profile of the device and the parameters that a room uses.
#pragma once

#include <optional>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "devices/device_profile.hpp"

namespace tandem::devices {

/// Returns the properties of the device that the stability check needs, converted by the scene's workspace mapping.
haptics::LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace = {});

/// Parameters of a coupling as a room uses them; input of check_coupling().
struct LoopCoupling {
  haptics::CouplingParameters parameters;
  double tool_mass_kg = 0;
  double tool_inertia_kg_m2 = 0;
  double slope_factor = 1;  ///< maximum slope of the force curve divided by its stiffness; 0: no loop
};
/// Returns the parameters that check_coupling() needs. Three cases differ from the given values:
/// * Law with a massless tool, no body held: tool mass and damping are 0.
/// * Law with a massless tool, a body held: all values are kept.
/// * Law without coupling: stiffness and damping are 0, so the check reports nothing.
LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                           double mass_kg, double inertia_kg_m2, bool is_held_body = false);

/// Returns a warning if the law may supply energy to the hand, whatever its coefficients are. Returns nothing for a
/// passive law.
std::optional<haptics::StabilityFinding> find_active_law(const haptics::CouplingLawInfo& law);

}  // namespace tandem::devices
