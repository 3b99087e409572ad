// Whether a scene's coupling is fit for this client's device: asked on the io thread, before the haptic thread sees it.
#pragma once

#include <vector>

#include "client/mailboxes.hpp"
#include "common/coupling/stability.hpp"
#include "devices/device_profile.hpp"
#include "tandem/control.pb.h"

namespace tandem {

/// What a tool, or what it can hold, weighs; both 0: not known.
struct MassRange {
  double low_kg = 0;
  double high_kg = 0;
};
/// Of the user's tool and of all that it could grab in this scene.
MassRange tool_masses(const wire::Joined& joined);

/// check_coupling() of what the haptic path would render of `scene` (bounded by the device), with the lightest and the
/// heaviest tool. It knows nothing of the network: what delay does to the loop is measured in the lab.
///
/// Out     at most one finding each for translation and rotation, the graver; empty for a law without a coupling
/// Cost    1 ms; 50 ms when there is something to find; allocates
std::vector<StabilityFinding> check_scene_coupling(const HapticScene& scene, const MassRange& tools,
                                                   const DeviceProfile& device);

bool has_unstable(const std::vector<StabilityFinding>& findings);

}  // namespace tandem
