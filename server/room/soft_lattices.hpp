// From the nodes of soft bodies to what windows are told of them.
#pragma once

#include <cstddef>
#include <vector>

#include "common/physics/world.hpp"
#include "proto/soft_shape.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// Of each soft body the points of proto::soft_lattice() in its box at rest; each goes with the nodes next to it.
///
/// Model   offset of a point = Σ wᵢ (xᵢ − Xᵢ) over the four nodes next to it at rest, w ∝ 1 / distance
/// Thread  measure(): the room's, without allocation
class SoftLattices {
 public:
  explicit SoftLattices(const std::vector<SoftModel>& bodies);

  /// As many offsets as there are points, all zero.
  std::vector<std::vector<Vec3>> at_rest() const;
  /// In      out  of the size of at_rest()
  void measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept;

 private:
  std::vector<std::vector<Vec3>> rest_W_;               ///< nodes
  std::vector<std::vector<proto::NearPlaces>> points_;  ///< with nodes
};

}  // namespace tandem::server
