// Bodies that go where somebody else said they go.
#pragma once

#include <vector>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Each body keeps the velocity that it has been told (World::set_body()): no weight, no contact and no push
/// changes it.
class FollowedBodies final : public FreeBodies {
 public:
  /// In      bodies  of the description
  explicit FollowedBodies(std::size_t bodies) : bodies_(bodies, nullptr) {}

  void add(std::size_t index, RigidBody& rigid) override { bodies_[index] = &rigid; }
  void remove(std::size_t index) override { bodies_[index] = nullptr; }
  void step(double step_s) noexcept override {
    for (RigidBody* body : bodies_) {
      if (body != nullptr && !body->is_static()) body->advance(body->velocity_of_centre_W(), step_s);
    }
  }

 private:
  std::vector<RigidBody*> bodies_;  ///< by index; null: not here
};

}  // namespace tandem::physics
