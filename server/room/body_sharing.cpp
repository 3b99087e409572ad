#include "server/room/body_sharing.hpp"

#include <algorithm>
#include <bit>

#include "common/physics/joints/delayed_joint.hpp"

namespace tandem::server {

BodySharing::BodySharing(const physics::World& world, std::span<const BodyId> bodies, std::size_t tools)
    : world_(world), bodies_(bodies.begin(), bodies.end()), hands_(bodies.size()), loops_(tools) {}

void BodySharing::update() noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) hands_[i] = world_.hands_on(bodies_[i]);
}

std::uint32_t BodySharing::hand_count(std::size_t i) const noexcept {
  return static_cast<std::uint32_t>(std::popcount(hands_[i]));
}

Duration BodySharing::slowest_loop(std::size_t tool) const noexcept {
  std::uint32_t sharing = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const bool has_own = (hands_[i] >> tool & 1U) != 0;
    if (has_own && physics::others_touch(hand_count(i), has_own)) sharing |= hands_[i];
  }
  Duration slowest{0};
  for (std::size_t other = 0; other < loops_.size(); ++other) {
    if ((sharing >> other & 1U) != 0) slowest = std::max(slowest, loops_[other]);
  }
  return slowest;
}

std::size_t BodySharing::other_holders(BodyId body, std::size_t tool) const noexcept {
  std::size_t holders = 0;
  for (std::size_t other = 0; other < loops_.size(); ++other) {
    if (other != tool && world_.tool(other).held == body) ++holders;
  }
  return holders;
}

}  // namespace tandem::server
