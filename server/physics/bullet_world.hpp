// Bullet's world with the settings that desk-sized scenes at 1 kHz need.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/physics/free_bodies.hpp"
#include "common/physics/world_description.hpp"
#include "server/physics/solid_shape.hpp"

namespace tandem::server {

/// The bodies that no tool touches, stepped by Bullet.
///
/// Same bodies, same forces, same bits: bodies are kept in the order in which they were added, the solver's
/// order is not randomised, and a step is one solver step.
///
/// Contact of two bodies: friction √(μ₁ μ₂), restitution the larger of both.
///
/// In      shapes  of each body of `world`
std::unique_ptr<physics::FreeBodies> make_bullet_world(const physics::WorldDescription& world,
                                                       std::span<const std::vector<SolidShape>> shapes);

}  // namespace tandem::server
