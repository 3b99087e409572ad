// From the nodes of soft bodies to what windows are told of them.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "common/physics/world.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// Of each soft body the points of proto::soft_lattice() in its box at rest; each goes with the nodes next to it.
///
/// Model   offset of a point = Σ wᵢ (xᵢ − Xᵢ) over the kNear nodes next to it at rest, w ∝ 1 / distance
/// Thread  measure(): the room's, without allocation
class SoftLattices {
 public:
  explicit SoftLattices(const std::vector<SoftModel>& bodies);

  /// As many offsets as there are points, all zero.
  std::vector<std::vector<Vec3>> at_rest() const;
  /// In      out  of the size of at_rest()
  void measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept;

 private:
  static constexpr std::size_t kNear = 4;
  using Point = std::array<std::pair<std::size_t, double>, kNear>;  ///< nodes and their weights
  static Point point_at(const Vec3& at_W, const std::vector<Vec3>& nodes_W);

  std::vector<std::vector<Vec3>> rest_W_;  ///< nodes
  std::vector<std::vector<Point>> points_;
};

}  // namespace tandem::server
