// Which bodies several users have their hands on, and over which delays they share them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "common/physics/world.hpp"

namespace tandem::server {

/// Thread  the room's; no allocation after construction
class BodySharing {
 public:
  /// In      world   outlives it
  ///         bodies  that can move
  ///         tools   how many the world has
  BodySharing(const physics::World& world, std::span<const BodyId> bodies, std::size_t tools);

  /// Of the user of a tool whose copies are joined to bodies (ClientMode::kLocalModel): from an input to its effect
  /// coming back. 0: none are joined.
  void set_loop(std::size_t tool, Duration loop) noexcept { loops_[tool] = loop; }
  /// After a step of the world.
  void update() noexcept;

  /// After the last step, how many hands are on the body that was given as the i-th.
  std::uint32_t hand_count(std::size_t i) const noexcept;
  /// The longest loop of all whose copies are joined to a body that this tool holds or touches together with another
  /// one, its own among them; 0: nobody else has a hand on it.
  Duration slowest_loop(std::size_t tool) const noexcept;
  /// Tools beside this one that hold the body now.
  std::size_t other_holders(BodyId body, std::size_t tool) const noexcept;

 private:
  const physics::World& world_;
  std::vector<BodyId> bodies_;
  std::vector<std::uint32_t> hands_;  ///< World::hands_on() each of them
  std::vector<Duration> loops_;       ///< by tool
};

}  // namespace tandem::server
