// Computes the offsets of the lattice points of soft bodies from their nodes, for windows.
#pragma once

#include <cstddef>
#include <vector>

#include "common/physics/world.hpp"
#include "proto/soft_shape.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// Offsets of the proto::soft_lattice() points in the rest box of each soft body. Each point follows its nearest nodes.
///
/// Model   offset of a point = Σ wᵢ (xᵢ − Xᵢ) over the four nodes nearest at rest, with w ∝ 1 / distance
/// Thread  measure(): room, without allocation
class SoftLattices {
 public:
  explicit SoftLattices(const std::vector<SoftModel>& bodies);

  /// Returns zero offsets, one for each point.
  std::vector<std::vector<Vec3>> at_rest() const;
  /// In      out  sized like at_rest()
  void measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept;

 private:
  std::vector<std::vector<Vec3>> rest_W_;               ///< node positions at rest
  std::vector<std::vector<proto::NearPlaces>> points_;  ///< points with their nearest nodes
};

}  // namespace tandem::server
