// The soft bodies of a world, seen from what they touch.
#pragma once

#include <span>

#include "common/base/tick_faults.hpp"
#include "common/physics/soft_contact.hpp"

namespace tandem::physics {

/// Where a movable thing is in this room step. Not present: touches nothing.
struct SoftTool {
  Pose X_WT;
  bool is_present = false;
};

/// Thread  one at a time (the world's)
class SoftBodies {
 public:
  virtual ~SoftBodies() = default;

  /// Once a step, after things have their new poses.
  /// In      tools  the world's tools, then its bodies
  virtual TickFaults advance(std::span<const SoftTool> tools) noexcept = 0;
  /// For soft_wrench(): of one of them, until the next advance(). Empty for one that is not present.
  virtual const SoftContact& contact(std::size_t tool) const noexcept = 0;
};

}  // namespace tandem::physics
