// Interface of a world to its soft bodies.
#pragma once

#include <optional>
#include <span>

#include "common/base/tick_faults.hpp"
#include "common/physics/soft_contact.hpp"

namespace tandem::physics {

/// Thread  one at a time (the world's)
class SoftBodies {
 public:
  virtual ~SoftBodies() = default;

  /// Advances by a step, after the things have their new poses.
  /// In      X_WT  poses of the world's tools, then of its bodies; none: touches nothing
  virtual TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept = 0;
  /// Contact of a tool or body for soft_wrench(), valid until the next advance(). Empty for an absent one.
  virtual const SoftContact& contact(std::size_t tool) const noexcept = 0;
  /// Positions of the nodes of a soft body, for viewers.
  virtual std::span<const Vec3> nodes_W(std::size_t body) const = 0;
  /// Sets the nodes of a soft body, at rest, before the first advance(). Nodes that are glued down stay.
  /// Fails   std::invalid_argument: wrong number of nodes
  virtual void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) = 0;
};

}  // namespace tandem::physics
