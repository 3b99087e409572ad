// Sampled distance to a mesh. Near the surface, samples are so dense that interpolation is as accurate as the mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/contact/field/distance_field.hpp"
#include "common/contact/field/plane_map.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {

struct ContactShapeOptions;
class BrickLattice;

/// Signed distance in bricks of 4³, 8³ or 16³ cells near the surface, and on a coarse lattice elsewhere.
///
/// Model   1. Samples are exact; between them, interpolation is trilinear. The gradient is that of the interpolant, so
///            that the force is the gradient of one potential.
///         2. Where bricks of different resolution meet, the border samples of the finer brick are interpolated from
///            the coarser one. Up to the distance band_m() from the surface, the distance is therefore continuous.
///         3. Farther away than band_m(), the magnitude of distance_m() is a lower bound that accounts for the
///            interpolation error. sample() returns the interpolated distance itself, because its slope is useful to
///            predict contact. Therefore |distance_m()| ≤ |sample().distance_m|.
///         4. For a point outside the lattice, sample() starts at the nearest point of the lattice's border and moves
///            along the gradient to the surface. It returns the distance of the given point from the surface point
///            found
/// Source  Frisken, Perry, Rockwood, Jones, "Adaptively sampled distance fields", SIGGRAPH 2000, for the refinement by
///         interpolation error
class DistanceGrid final : public DistanceField {
 public:
  /// In      progress  called on the calling thread from time to time with the completed fraction, 0..1; may be empty
  /// Fails   std::invalid_argument: an option out of its range; MeshError: the mesh needs too many cells of this size
  /// Cost    see `tandem-lab bench contact`. The result is bitwise the same for any number of threads
  static std::unique_ptr<DistanceGrid> build(const geometry::ContactMesh& mesh, const geometry::TriangleTree& tree,
                                             const ContactShapeOptions& options,
                                             const std::function<void(double)>& progress);

  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;
  void sample_all(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept override;
  void distances_m(const EightPlaces& p_S, std::size_t count, EightNumbers& distances_m) const noexcept override;
  std::span<const FieldPlane> planes() const noexcept override { return planes_.planes(); }
  PlaneSet planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept override {
    return planes_.planes_over(box_S, queries);
  }
  PlaneSet planes_at(const Vec3& p_S) const noexcept override { return planes_.planes_at(p_S); }
  /// Returns the largest interpolation error that was measured while the grid was built. It was measured in the middles
  /// of cells, where interpolation is worst. The error is largest at sharp convex edges, inside and beneath them, where
  /// the distance has a crease.
  double error_m() const noexcept override { return error_m_; }
  double band_m() const noexcept override { return band_m_; }

  /// Finds planes that replace the field, and the blocks (parts of bricks, see PlaneMap) in which they do;
  /// planes_over() returns them. `guesses` are approximate planes, which are first fitted to nearby samples.
  void find_planes(std::vector<FieldPlane> guesses);

  double finest_cell_m() const { return cell_m(finest_); }
  double coarsest_cell_m() const { return cell_m(coarsest_); }  ///< coarsest cells near the surface
  std::size_t brick_count(int cells) const;                     ///< number of bricks with `cells`³ cells
  std::size_t memory_bytes() const;

  /// Appends the grid to `bytes`. The compression is lossless, since build() has already rounded all samples to values
  /// that the format represents exactly.
  void write(std::vector<std::uint8_t>& bytes, int packing_level) const;
  /// Reads bytes that write() wrote and removes them from `bytes`. Returns null for any other bytes, or if the grid
  /// needs more memory than `limit_bytes`. Every count, index and number is checked, so malicious files are safe.
  static std::unique_ptr<DistanceGrid> read(std::span<const std::uint8_t>& bytes, std::size_t limit_bytes);

 private:
  friend class DistanceGridBuilder;

  static constexpr std::size_t kMaxBricks = std::size_t{1} << 24U;
  static constexpr std::uint32_t kLevels = 3;
  static constexpr std::uint32_t kLevelBits = 2;
  static constexpr std::uint32_t kFirstSampleLimit = 1U << (32U - kLevelBits);

  static constexpr std::uint32_t cells_of(std::uint32_t level) { return 4U << level; }
  static constexpr std::uint32_t samples_of(std::uint32_t level) {
    const std::uint32_t edge = cells_of(level) + 1;
    return edge * edge * edge;
  }

  struct Place;
  class PlaneFinder;

  DistanceGrid() = default;
  double cell_m(std::uint32_t level) const { return brick_m_ / cells_of(level); }
  /// Returns the predicted value of a sample at a corner of the lattice, in quanta.
  int corner_quanta(std::size_t corner) const;
  BrickLattice lattice() const;
  bool set_lattice(const BrickLattice& lattice);
  bool read_header(ByteReader& reader);
  bool read_corners(ByteReader& reader, std::size_t limit_bytes);
  bool read_samples(ByteReader& reader, std::size_t limit_bytes);
  std::size_t brick_total() const;
  std::size_t corner_total() const;
  bool set_levels(std::span<const std::uint8_t> levels, std::size_t sample_count);
  bool is_sound() const;
  static constexpr std::uint32_t level_of(std::uint32_t ref) { return (ref & ((1U << kLevelBits) - 1U)) - 1U; }
  /// Returns a bound of the interpolation error beyond the band, where finer samples are interpolated from coarser
  /// ones. A distance has the Lipschitz constant 1, so each level adds at most half of the diagonal of its cells. The
  /// bound is the sum over the levels up to `level`.
  double slack_m(std::uint32_t level) const {
    constexpr double kHalfDiagonal = 0.8660254037844386;
    return kHalfDiagonal * (2.0 * cell_m(0) - cell_m(level));
  }
  bool locate(const Vec3& p_S, Place& place) const noexcept;
  const std::uint32_t& ref_at(const Place& place) const noexcept;
  DistanceSample sample_brick(const Place& place, std::uint32_t ref) const noexcept;
  void sample_cells(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept;
  DistanceSample sample_corners(const Place& place) const noexcept;
  double far_distance_m(const Place& place) const noexcept;
  DistanceSample sample_outside(const Vec3& p_S) const noexcept;
  double distance_to_bounds_m(const Vec3& p_S) const noexcept;

  Vec3 origin_S_ = Vec3::Zero();                     ///< low corner of the lattice
  std::array<std::uint32_t, 3> bricks_ = {1, 1, 1};  ///< number of bricks along x, y, z
  double brick_m_ = 1;                               ///< edge of a brick
  double bricks_per_m_ = 1;
  double quantum_m_ = 1;           ///< distance that one step of a stored sample represents
  double corner_quantum_m_ = 1;    ///< distance that one step of a stored corner value represents
  std::uint16_t sample_step_ = 1;  ///< SampleCoding::step
  double band_m_ = 0;
  double error_m_ = 0;
  Vec3 low_S_ = Vec3::Zero();  ///< box around all points with a negative distance
  Vec3 high_S_ = Vec3::Zero();
  std::uint32_t finest_ = 0;
  std::uint32_t coarsest_ = 0;
  /// Reference of each brick, x fastest: 0 for a brick without samples, else index of first sample · 4 + level + 1.
  std::vector<std::uint32_t> refs_;
  std::vector<float> corners_m_;  ///< distances at the corners of all bricks
  std::vector<std::int16_t> samples_;
  PlaneMap planes_;
};

}  // namespace tandem::contact
