// A scene asks for a coupling, a device bears only so much: what the hand is shown, and what is checked beforehand, is
// bounded by this one function.
#pragma once

#include <string_view>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::client {

/// `asked`, with each coefficient at most what keeps the device D, which is moved and pushed by scaled amounts, within
/// `device_bounds`: newtons and metres of the device in, of the world out. A stiffness is bounded by the steepest slope
/// of the law's force.
///
/// Thread  haptic and io: no allocation, no throw
haptics::CouplingParameters rendered_coupling(std::string_view law, const haptics::CouplingParameters& asked,
                                              const haptics::CouplingParameters& device_bounds,
                                              const WorkspaceMapping& workspace) noexcept;

}  // namespace tandem::client
