// Interface of the component that moves the bodies that no tool touches. At the server, UntouchedBodies moves them with
// the contact solver. At a client, FollowedBodies extrapolates the server's states.
#pragma once

#include <cstddef>

#include "common/base/tick_faults.hpp"
#include "common/physics/rigid_body.hpp"

namespace tandem::physics {

/// Component that moves the free bodies of a world.
///
/// Thread  the thread that steps the world
class FreeBodies {
 public:
  virtual ~FreeBodies() = default;

  /// Adds `rigid` as the body with this index in the description. The address of `rigid` must not change until
  /// remove(). Static bodies must be added as well, because moving bodies collide with them.
  virtual void add(std::size_t index, RigidBody& rigid) = 0;
  virtual void remove(std::size_t index) = 0;
  /// Sets the gravity of the next steps. Initially it is that of the description.
  virtual void set_gravity(const Vec3& /*m_per_s2*/) noexcept {}
  /// Moves the added bodies by one step from their present states. Uses and clears their applied wrenches
  /// (RigidBody::apply_wrench()). The new states may be not finite; the world checks them.
  virtual TickFaults step(double step_s) noexcept = 0;
};

}  // namespace tandem::physics
