// Computes the offsets of the lattice points of soft bodies from the motion of their nodes, for display at clients.
#pragma once

#include <cstddef>
#include <vector>

#include "common/physics/world.hpp"
#include "proto/soft_shape.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// Offsets of the points of a lattice (proto::soft_lattice()) in the rest box of each soft body. A point follows the
/// nodes nearest to it.
///
/// Model   offset of a point = Σ wᵢ (xᵢ − Xᵢ) over the four nodes that are nearest to it at rest.
///         * xᵢ, Xᵢ: current position and rest position of node i
///         * wᵢ: weight of node i, proportional to 1 / its distance from the point at rest; Σ wᵢ = 1
/// Thread  measure(): room, without allocation
class SoftLattices {
 public:
  explicit SoftLattices(const std::vector<SoftModel>& bodies);

  /// Returns one zero offset for each point.
  std::vector<std::vector<Vec3>> at_rest() const;
  /// Computes the current offsets of all points.
  /// In      out  has the size of at_rest()
  void measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept;

 private:
  std::vector<std::vector<Vec3>> rest_W_;               ///< node positions at rest
  std::vector<std::vector<proto::NearPlaces>> points_;  ///< points with their nearest nodes
};

}  // namespace tandem::server
