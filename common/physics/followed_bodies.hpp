// Free bodies of a client: their states are those received from the server.
#pragma once

#include <cstddef>
#include <memory>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Creates free bodies for a client. They move without forces, from the last state set by World::set_body(). Weight,
/// contact and applied wrenches do not change their momentum.
/// In      bodies  number of bodies in the description
std::unique_ptr<FreeBodies> make_followed_bodies(std::size_t bodies);

}  // namespace tandem::physics
