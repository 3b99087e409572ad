// Interface between a world and its soft bodies.
#pragma once

#include <optional>
#include <span>

#include "common/base/tick_faults.hpp"
#include "common/physics/soft_contact.hpp"

namespace tandem::physics {

/// Soft bodies of a world.
///
/// Thread  the thread that steps the world
class SoftBodies {
 public:
  virtual ~SoftBodies() = default;

  /// Advances by a step, after the rigid tools and bodies have moved to their new poses.
  /// In      X_WT  poses of the world's tools, then of its bodies; empty for an absent object, which has no contact
  ///         with soft bodies
  virtual TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept = 0;
  /// Returns the contact of a tool or body for soft_wrench(), valid until the next advance(). An object without a pose
  /// has an empty contact.
  virtual const SoftContact& contact(std::size_t tool) const noexcept = 0;
  /// Positions of the nodes of a soft body, for display.
  virtual std::span<const Vec3> nodes_W(std::size_t body) const = 0;
  /// Sets the nodes of a soft body, at rest. Allowed only before the first advance(). Fixed nodes keep their positions.
  /// Fails   throws std::invalid_argument for a wrong number of nodes
  virtual void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) = 0;
};

}  // namespace tandem::physics
