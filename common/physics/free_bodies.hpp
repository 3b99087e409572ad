// Interface of the component that moves the bodies that no tool touches. At the server it is the contact solver
// (UntouchedBodies), at a client it follows the server's states (FollowedBodies).
#pragma once

#include <cstddef>

#include "common/base/tick_faults.hpp"
#include "common/physics/rigid_body.hpp"

namespace tandem::physics {

/// Thread  one at a time (the world's)
class FreeBodies {
 public:
  virtual ~FreeBodies() = default;

  /// Adds `rigid`, body `index` of the description, until it is removed; its address must not change meanwhile. Static
  /// bodies are added too: others collide with them.
  virtual void add(std::size_t index, RigidBody& rigid) = 0;
  virtual void remove(std::size_t index) = 0;
  /// Moves the added bodies by a step from their present states, and consumes their applied wrenches
  /// (RigidBody::apply_wrench()). The world checks the new states for non-finite values.
  virtual TickFaults step(double step_s) noexcept = 0;
};

}  // namespace tandem::physics
