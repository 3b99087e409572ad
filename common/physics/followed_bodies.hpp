// Bodies that go where somebody else said they go.
#pragma once

#include <cstddef>
#include <memory>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Each body keeps the velocity that it has been told (World::set_body()): no weight, no contact and no push
/// changes it.
/// In      bodies  of the description
std::unique_ptr<FreeBodies> make_followed_bodies(std::size_t bodies);

}  // namespace tandem::physics
