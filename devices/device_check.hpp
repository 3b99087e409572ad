// A coupling law on a device: prepares the inputs of the stability check (common/haptics/coupling/stability.hpp) from a
// profile and from the way a room runs the law.
#pragma once

#include <optional>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "devices/device_profile.hpp"

namespace tandem::devices {

/// The device as seen by the coupling loop, through the scene's workspace mapping.
haptics::LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace = {});

/// A coupling as a room runs it, input of check_coupling().
struct LoopCoupling {
  haptics::CouplingParameters parameters;
  double tool_mass_kg = 0;
  double tool_inertia_kg_m2 = 0;
  double slope_factor = 1;  ///< 0: the law has no loop of its own
};
/// The free tool of a massless law has no mass and no damper; a body that it holds keeps both. A law without a coupling
/// gets a coupling of 0, for which check_coupling() has no findings.
LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                           double mass_kg, double inertia_kg_m2, bool is_held_body = false);

/// A warning about a law that is not passive for any coefficients; empty for a passive law.
std::optional<haptics::StabilityFinding> find_active_law(const haptics::CouplingLawInfo& law);

}  // namespace tandem::devices
