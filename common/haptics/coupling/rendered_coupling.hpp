// A scene asks for a coupling, a device bears only so much: what the hand is shown, what its tool at the server is pulled
// with, and what is checked beforehand are bounded by this one function.
#pragma once

#include <limits>
#include <string_view>

#include "common/base/workspace.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

/// Of a device that bears anything.
inline constexpr CouplingParameters kNoCouplingBounds = [] {
  constexpr double kAnything = std::numeric_limits<double>::infinity();
  return CouplingParameters{kAnything, kAnything, kAnything, kAnything, kAnything, kAnything, kAnything, kAnything};
}();

/// In the world, what keeps the device D, which is moved and pushed by scaled amounts, within `device_bounds`.
CouplingParameters coupling_bounds_in_world(const CouplingParameters& device_bounds,
                                            const WorkspaceMapping& workspace) noexcept;

/// `asked`, with each coefficient at most its bound, both in the world. A stiffness is bounded by the steepest slope of
/// the law's force. Bounded once more it stays what it is.
///
/// Thread  any: no allocation, no throw
CouplingParameters rendered_coupling(std::string_view law, const CouplingParameters& asked,
                                     const CouplingParameters& bounds_W) noexcept;

}  // namespace tandem::haptics
