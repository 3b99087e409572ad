// Who moves the bodies that no tool touches: an engine at the server, at a client what the server says of them.
#pragma once

#include <cstddef>

#include "common/physics/rigid_body.hpp"

namespace tandem::physics {

/// Thread  one at a time (the world's)
class FreeBodies {
 public:
  virtual ~FreeBodies() = default;

  /// From now on `rigid`, which is body `index` of the description, is stepped here, static ones too: things collide
  /// with them. It stays where it is in memory until it is removed.
  virtual void add(std::size_t index, RigidBody& rigid) = 0;
  virtual void remove(std::size_t index) = 0;
  /// Moves all that were added on by a step, from the state that each has now, and spends what was applied to it
  /// (RigidBody::apply_wrench()). Finite or not: the world looks after that.
  virtual void step(double step_s) noexcept = 0;
};

}  // namespace tandem::physics
