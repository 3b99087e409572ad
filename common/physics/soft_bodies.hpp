// The soft bodies of a world, seen from what they touch.
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

  /// Once a step, after things have their new poses.
  /// In      X_WT  where the world's tools are, then its bodies; none: touches nothing
  virtual TickFaults advance(std::span<const std::optional<Pose>> X_WT) noexcept = 0;
  /// For soft_wrench(): of one of them, until the next advance(). Empty for one that is not there.
  virtual const SoftContact& contact(std::size_t tool) const noexcept = 0;
  /// Where the nodes of one are, for viewers.
  virtual std::span<const Vec3> nodes_W(std::size_t body) const = 0;
  /// Before the first advance(): the nodes of one are here, at rest; those that are glued down stay.
  /// Fails   std::invalid_argument: another number of nodes
  virtual void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) = 0;
};

}  // namespace tandem::physics
