// Interface of the component that moves the bodies that no tool touches. At the server a contact solver moves them
// (UntouchedBodies). At a client they follow the server's states (FollowedBodies).
#pragma once

#include <cstddef>

#include "common/base/tick_faults.hpp"
#include "common/physics/rigid_body.hpp"

namespace tandem::physics {

/// Component that moves the free bodies of a world.
///
/// Thread  one thread at a time, that of the world
class FreeBodies {
 public:
  virtual ~FreeBodies() = default;

  /// Adds `rigid`, body `index` of the description. Until remove() its address must not change. Static bodies are
  /// added, too, because other bodies collide with them.
  virtual void add(std::size_t index, RigidBody& rigid) = 0;
  virtual void remove(std::size_t index) = 0;
  /// Sets the gravity of the next steps. Initially it is that of the description.
  virtual void set_gravity(const Vec3& /*m_per_s2*/) noexcept {}
  /// Moves the added bodies by one step from their present states. Uses and clears their applied wrenches
  /// (RigidBody::apply_wrench()). The world checks the new states for values that are not finite.
  virtual TickFaults step(double step_s) noexcept = 0;
};

}  // namespace tandem::physics
