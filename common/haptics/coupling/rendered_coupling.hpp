// Clamps the coupling of a scene to the limits of a device. The clamped coupling is used in three places: for the
// displayed force, for the tool at the server, and for the stability check.
#pragma once

#include <limits>
#include <string_view>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Coupling bounds for a device without limits: all infinite.
inline constexpr CouplingParameters kNoCouplingBounds = [] {
  constexpr double kAnything = std::numeric_limits<double>::infinity();
  return CouplingParameters{kAnything, kAnything, kAnything, kAnything, kAnything, kAnything, kAnything, kAnything};
}();

/// Converts coupling bounds of a device to coupling bounds in the world. If a coupling in the world respects the
/// result, the same coupling, scaled by `workspace` to the device, respects `device_bounds`.
CouplingParameters coupling_bounds_in_world(const CouplingParameters& device_bounds,
                                            const WorkspaceMapping& workspace) noexcept;

/// Returns `requested` with each coefficient clamped to its bound, both in world units. The bound on stiffness limits
/// the steepest slope of the law's force. The function is idempotent: clamping a result again does not change it.
///
/// Thread  any: no allocation, no throw
CouplingParameters rendered_coupling(std::string_view law, const CouplingParameters& requested,
                                     const CouplingParameters& bounds_W) noexcept;

}  // namespace tandem::haptics
