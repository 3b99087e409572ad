// The distance to a mesh, sampled so finely that interpolation is as good as the mesh, and only near its surface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/mesh_repair.hpp"
#include "common/contact/triangle_tree.hpp"

namespace tandem {

struct DistanceGridOptions {
  double cell_m = 8e-4;       ///< largest cell edge near the surface; cells are halved up to twice where needed
  double tolerance_m = 1e-5;  ///< largest interpolation error near the surface that does not halve the cells
  double band_m = 1.5e-3;     ///< distances up to this are sampled at full resolution
  /// A sheet is felt as a plate of this thickness around it.
  double sheet_thickness_m = 1e-3;
  int threads = 2;
};

/// Signed distance in bricks of 4³, 8³ or 16³ cells where the surface is near, and on a coarse lattice elsewhere.
///
/// Model   trilinear interpolation of exact samples; the gradient is that of the interpolant, so that force is the
///         gradient of one potential. Where bricks of different resolution meet, the finer one's border follows the
///         coarser's interpolation: the distance is continuous everywhere.
/// Source  Frisken, Perry, Rockwood, Jones, "Adaptively sampled distance fields", SIGGRAPH 2000, for the refinement by
///         interpolation error
class DistanceGrid final : public DistanceField {
 public:
  /// In      progress  called from one thread now and then, 0..1; may be empty
  /// Cost    see `tandem-lab bench contact`; the same bytes for any number of threads
  static std::unique_ptr<DistanceGrid> build(const ContactMesh& mesh, const TriangleTree& tree,
                                             const DistanceGridOptions& options,
                                             const std::function<void(double)>& progress);

  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;
  double error_m() const noexcept override;
  double band_m() const noexcept override;

  double finest_cell_m() const;
  double coarsest_cell_m() const;  ///< of the cells near the surface
  std::size_t memory_bytes() const;

  /// Appends to `bytes`, little-endian.
  void write(std::vector<std::uint8_t>& bytes) const;
  /// Reads what write() wrote and moves `bytes` past it. Null for anything else: every count, index and number of a
  /// hostile file is checked.
  static std::unique_ptr<DistanceGrid> read(std::span<const std::uint8_t>& bytes);
};

}  // namespace tandem
