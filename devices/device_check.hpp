// Stability of a coupling law on a device. It derives the inputs of the stability check
// (common/haptics/coupling/stability.hpp) from the device's profile and from the way a room uses the law.
#pragma once

#include <optional>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "devices/device_profile.hpp"

namespace tandem::devices {

/// Returns the properties of the device for the check of the coupling loop, converted by the scene's workspace mapping.
haptics::LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace = {});

/// Parameters of a coupling as a room uses them; input of check_coupling().
struct LoopCoupling {
  haptics::CouplingParameters parameters;
  double tool_mass_kg = 0;
  double tool_inertia_kg_m2 = 0;
  double slope_factor = 1;  ///< maximum slope of the law relative to its stiffness; 0: the law closes no loop
};
/// Returns the parameters for check_coupling(). For a law with a massless tool, mass and damping of the free tool are
/// 0; those of a held body are kept. For a law without coupling, stiffness and damping are 0, for which the check
/// reports nothing.
LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                           double mass_kg, double inertia_kg_m2, bool is_held_body = false);

/// Returns a warning if the law is not passive for any coefficients, or nothing for a passive law.
std::optional<haptics::StabilityFinding> find_active_law(const haptics::CouplingLawInfo& law);

}  // namespace tandem::devices
