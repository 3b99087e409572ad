// Free bodies of a client, which follow the server's states.
#pragma once

#include <cstddef>
#include <memory>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Moves each body freely from the last state set (World::set_body()). No weight, contact or applied wrench changes its
/// momentum.
/// In      bodies  number of bodies in the description
std::unique_ptr<FreeBodies> make_followed_bodies(std::size_t bodies);

}  // namespace tandem::physics
