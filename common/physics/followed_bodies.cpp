#include "common/physics/followed_bodies.hpp"

#include <vector>

namespace tandem::physics {
namespace {

class FollowedBodies final : public FreeBodies {
 public:
  explicit FollowedBodies(std::size_t bodies) : bodies_(bodies, nullptr) {}

  void add(std::size_t index, RigidBody& rigid) override { bodies_[index] = &rigid; }
  void remove(std::size_t index) override { bodies_[index] = nullptr; }
  TickFaults step(double step_s) noexcept override {
    for (RigidBody* body : bodies_) {
      if (body != nullptr && !body->is_static()) body->advance(body->velocity_of_centre_W(), step_s);
    }
    return 0;
  }

 private:
  std::vector<RigidBody*> bodies_;  ///< bodies, with the same index as in the description; null: not added
};

}  // namespace

std::unique_ptr<FreeBodies> make_followed_bodies(std::size_t bodies) {
  return std::make_unique<FollowedBodies>(bodies);
}

}  // namespace tandem::physics
