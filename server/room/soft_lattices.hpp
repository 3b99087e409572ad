// Offsets of the lattice points of soft bodies, computed from their nodes, for windows.
#pragma once

#include <cstddef>
#include <vector>

#include "common/physics/world.hpp"
#include "proto/soft_shape.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// The proto::soft_lattice() points in the rest box of each soft body; each follows its nearest nodes.
///
/// Model   offset of a point = Σ wᵢ (xᵢ − Xᵢ) over the four nodes nearest at rest, w ∝ 1 / distance
/// Thread  measure(): room, without allocation
class SoftLattices {
 public:
  explicit SoftLattices(const std::vector<SoftModel>& bodies);

  /// Zero offsets, one for each point.
  std::vector<std::vector<Vec3>> at_rest() const;
  /// In      out  sized like at_rest()
  void measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept;

 private:
  std::vector<std::vector<Vec3>> rest_W_;               ///< nodes at rest
  std::vector<std::vector<proto::NearPlaces>> points_;  ///< with their nearest nodes
};

}  // namespace tandem::server
