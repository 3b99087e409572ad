// A coupling on a device: what the stability check (common/coupling/stability.hpp) needs to know of a profile.
#pragma once

#include "common/coupling/stability.hpp"
#include "common/workspace.hpp"
#include "devices/device_profile.hpp"

namespace tandem {

/// The device as the loop sees it, through the scene's workspace mapping.
LoopDevice loop_device(const DeviceProfile& profile, const WorkspaceMapping& workspace = {});

}  // namespace tandem
