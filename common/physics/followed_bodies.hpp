// Bodies that go where somebody else said they go.
#pragma once

#include <cstddef>
#include <memory>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Each body moves freely from the last state set (World::set_body()): no weight, contact or applied wrench changes
/// its momentum.
/// In      bodies  of the description
std::unique_ptr<FreeBodies> make_followed_bodies(std::size_t bodies);

}  // namespace tandem::physics
