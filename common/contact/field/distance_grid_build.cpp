// Builds a distance grid from a mesh: chooses bricks and their resolution, samples them, and matches their borders.
// Each brick is sampled independently. Threads therefore share no data, and their number does not affect the result.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/base/parallel_for.hpp"
#include "common/contact/contact_shape_options.hpp"
#include "common/contact/field/brick_lattice.hpp"
#include "common/contact/field/distance_grid.hpp"

namespace tandem::contact {
namespace {

/// Quantization step of distances near the surface, as a fraction of the tolerance.
constexpr double kCodingShare = 1.0 / 16;
/// Number of bricks that are sampled to estimate the memory of a grid. If the estimate exceeds the limit, cells are
/// widened. kWidenFor is a safety factor of the widening.
constexpr std::size_t kBricksToExpectBy = 500;
constexpr double kWidenFor = 1.05;
/// Number of quantization steps in a brick's edge, for the distances at its corners.
constexpr double kCornerSteps = 512;

/// Returns a function that computes the distance to a mesh: the signed distance to a solid, the distance to the plate
/// made from a sheet, or the smaller of the two. The function keeps references to the trees.
///
/// In      sheet  sheet that belongs to the mesh beside its solid; null if there is none
ExactDistance exact_distance(const geometry::TriangleTree& tree, geometry::SurfaceKind kind,
                             const geometry::TriangleTree* sheet, double sheet_thickness_m) {
  const bool is_solid = kind == geometry::SurfaceKind::kSolid;
  return [&tree, is_solid, sheet, half_thickness_m = sheet_thickness_m / 2](const Vec3& p_S, int& hint) {
    const auto closest = tree.closest_of_solid(p_S, std::numeric_limits<double>::infinity(), hint);
    hint = closest.triangle;
    if (!is_solid) return closest.distance_m - half_thickness_m;
    const bool is_inside = (p_S - closest.point_S).dot(closest.normal_S) < 0;
    const double distance_m = is_inside ? -closest.distance_m : closest.distance_m;
    // The plate is nearer than the solid only if the sheet, its middle surface, is nearer than this value.
    const double reach_m = distance_m + half_thickness_m;
    if (sheet == nullptr || reach_m <= 0) return distance_m;
    return std::min(distance_m, sheet->closest(p_S, reach_m).distance_m - half_thickness_m);
  };
}

}  // namespace

class DistanceGridBuilder {
 public:
  DistanceGridBuilder(const geometry::ContactMesh& mesh, const geometry::TriangleTree& tree,
                      const ContactShapeOptions& options, const std::function<void(double)>& progress)
      : options_(options),
        sheet_(mesh.sheet.triangles.empty() ? nullptr : std::make_unique<geometry::TriangleTree>(mesh.sheet)),
        exact_(exact_distance(tree, mesh.kind, sheet_.get(), options.sheet_thickness_m)),
        progress_(progress),
        grid_(new DistanceGrid) {
    lay_lattice(mesh);
  }

  /// Chooses the bricks. Returns the memory that the grid will need [bytes], estimated by sampling some of the bricks.
  double lay_out(bool is_solid) {
    measure_corners();
    if (is_solid)
      settle_signs(grid_->corners_m_, {corners_along(0), corners_along(1), corners_along(2)},
                   kRounding * grid_->brick_m_);
    find_bricks();
    return bytes_expected();
  }
  std::unique_ptr<DistanceGrid> build() {
    sample_bricks();
    code_corners();
    code_samples();
    measure_error();
    collect();
    return std::move(grid_);
  }

 private:
  void lay_lattice(const geometry::ContactMesh& mesh);
  void measure_corners();
  void find_bricks();
  double bytes_expected() const;
  void sample(Brick& brick) const;
  void sample_bricks();
  void code_samples();
  void code_corners();
  void measure_error();
  void collect();
  /// Calls work(i) for all i below `count`, on all threads, and reports progress.
  template <typename Work>
  void in_parallel(std::size_t count, double progress_from, double progress_to, const Work& work) const {
    parallel_for(options_.threads, count, work, [&](std::size_t i) {
      const double share = static_cast<double>(i + 1) / static_cast<double>(count);
      if (progress_) progress_(progress_from + (progress_to - progress_from) * share);
    });
  }
  Vec3 corner_S(std::size_t x, std::size_t y, std::size_t z) const {
    return grid_->origin_S_ +
           Vec3(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) * grid_->brick_m_;
  }
  std::size_t corners_along(std::size_t axis) const { return std::size_t{grid_->bricks_[axis]} + 1; }

  ContactShapeOptions options_;
  std::unique_ptr<const geometry::TriangleTree> sheet_;
  ExactDistance exact_;
  const std::function<void(double)>& progress_;
  std::unique_ptr<DistanceGrid> grid_;
  BrickLattice lattice_;
};

void DistanceGridBuilder::lay_lattice(const geometry::ContactMesh& mesh) {
  DistanceGrid& grid = *grid_;
  Vec3 low = mesh.mesh.vertices.at(static_cast<std::size_t>(mesh.mesh.triangles.at(0)[0]));
  Vec3 high = low;
  for (const geometry::TriangleMesh* part : {&mesh.mesh, &mesh.sheet}) {
    for (const auto& triangle : part->triangles) {
      for (const int vertex : triangle) {
        low = low.cwiseMin(part->vertices[static_cast<std::size_t>(vertex)]);
        high = high.cwiseMax(part->vertices[static_cast<std::size_t>(vertex)]);
      }
    }
  }
  const bool has_sheet = mesh.kind == geometry::SurfaceKind::kSheet || sheet_ != nullptr;
  const double thickness = has_sheet ? options_.sheet_thickness_m / 2 : 0.0;
  grid.low_S_ = low.array() - thickness;
  grid.high_S_ = high.array() + thickness;
  grid.brick_m_ = kBrickCells * options_.cell_m;
  grid.bricks_per_m_ = 1.0 / grid.brick_m_;
  grid.band_m_ = options_.band_m;
  // The quantum follows from the largest distance that is sampled. The middle of a sampled brick is within the band
  // plus half of the brick's diagonal of the surface, and each sample is within another half diagonal of the middle.
  grid.quantum_m_ = (grid.band_m_ + grid.brick_m_ * std::sqrt(3.0)) / kSampleSteps;
  // The margin is the band plus one brick, so that the lattice's border is outside of the shape and not near its
  // surface.
  const double margin = grid.band_m_ + grid.brick_m_;
  const Vec3 size = grid.high_S_ - grid.low_S_ + Vec3::Constant(2 * margin);
  const Vec3 counts = (size * grid.bricks_per_m_).array().ceil();
  if (!(counts.prod() <= static_cast<double>(DistanceGrid::kMaxBricks)) || !is_finite(size)) {
    throw geometry::MeshError("mesh is " + std::to_string((high - low).maxCoeff()) +
                              " m long: too large for cells of " + std::to_string(options_.cell_m) +
                              " m; is its unit metres? Scale it, or enlarge cell_m");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.bricks_[axis] = static_cast<std::uint32_t>(counts[static_cast<Eigen::Index>(axis)]);
  }
  grid.origin_S_ = 0.5 * (low + high - counts * grid.brick_m_);
  grid.corner_quantum_m_ = grid.brick_m_ / kCornerSteps;
  grid.sample_step_ = static_cast<std::uint16_t>(
      std::clamp(std::floor(options_.tolerance_m * kCodingShare / grid.quantum_m_), 1.0, 1024.0));
  lattice_ = BrickLattice(grid.bricks_);
}

void DistanceGridBuilder::measure_corners() {
  grid_->corners_m_.resize(grid_->corner_total());
  const std::size_t nx = corners_along(0);
  const std::size_t ny = corners_along(1);
  in_parallel(corners_along(2), 0.0, 0.1, [&](std::size_t z) {
    int row_hint = -1;
    for (std::size_t y = 0; y < ny; ++y) {
      int hint = row_hint;
      for (std::size_t x = 0; x < nx; ++x) {
        grid_->corners_m_[(z * ny + y) * nx + x] = static_cast<float>(exact_(corner_S(x, y, z), hint));
        if (x == 0) row_hint = hint;
      }
    }
  });
}

void DistanceGridBuilder::find_bricks() {
  const auto [nx, ny, nz] = grid_->bricks_;
  const double diagonal_m = grid_->brick_m_ * std::sqrt(3.0);
  std::vector<std::vector<Brick>> layers(nz);
  in_parallel(nz, 0.1, 0.15, [&, nx = nx, ny = ny](std::size_t z) {
    for (std::size_t y = 0; y < ny; ++y) {
      int hint = -1;
      for (std::size_t x = 0; x < nx; ++x) {
        const double corner_m = grid_->corners_m_[(z * (ny + 1) + y) * (nx + 1) + x];
        if (std::abs(corner_m) > grid_->band_m_ + diagonal_m) continue;
        const Vec3 middle_S = corner_S(x, y, z) + Vec3::Constant(0.5 * grid_->brick_m_);
        if (std::abs(exact_(middle_S, hint)) > grid_->band_m_ + 0.5 * diagonal_m) continue;
        Brick brick;
        brick.index = lattice_.index_of(
            {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z)});
        brick.hint = hint;
        layers[z].push_back(std::move(brick));
      }
    }
  });
  for (std::vector<Brick>& layer : layers) {
    for (Brick& brick : layer) lattice_.add(std::move(brick));
  }
}

void DistanceGridBuilder::sample(Brick& brick) const {
  const auto [x, y, z] = lattice_.position_of(brick.index);
  sample_brick(exact_, corner_S(x, y, z), grid_->brick_m_, grid_->band_m_, options_.tolerance_m, grid_->quantum_m_,
               DistanceGrid::kLevels, brick);
}

double DistanceGridBuilder::bytes_expected() const {
  const std::size_t every = 1 + lattice_.bricks.size() / kBricksToExpectBy;
  std::atomic<std::size_t> samples{0};
  in_parallel((lattice_.bricks.size() + every - 1) / every, 0.15, 0.2, [&](std::size_t i) {
    Brick brick = lattice_.bricks[i * every];
    sample(brick);
    samples += every * brick.samples.size();
  });
  return static_cast<double>(grid_->corner_total() * (sizeof(float) + sizeof(std::uint32_t)) +
                             samples * sizeof(std::int16_t));
}

void DistanceGridBuilder::sample_bricks() {
  in_parallel(lattice_.bricks.size(), 0.2, 0.97, [&](std::size_t i) { sample(lattice_.bricks[i]); });
}

/// Rounds the samples to the values that a receiver decodes.
void DistanceGridBuilder::code_samples() {
  const SampleCoding coding{grid_->sample_step_};
  lattice_.code(
      coding, [this](std::size_t corner) { return grid_->corner_quanta(corner); },
      [&coding](int, int predicted, int sample) { return coding.steps_to(sample, predicted); });
}

void DistanceGridBuilder::code_corners() {
  for (float& corner_m : grid_->corners_m_) {
    const double steps = std::round(static_cast<double>(corner_m) / grid_->corner_quantum_m_);
    corner_m = static_cast<float>(steps * grid_->corner_quantum_m_);
  }
}

void DistanceGridBuilder::measure_error() {
  grid_->error_m_ = grid_->corner_quantum_m_ / 2;
  for (const Brick& brick : lattice_.bricks) {
    for (const TestPoint& test : brick.tests) {
      const double interpolated_m = brick.interpolated_at({test.at[0], test.at[1], test.at[2]}) * grid_->quantum_m_;
      grid_->error_m_ = std::max(grid_->error_m_, std::abs(interpolated_m - static_cast<double>(test.distance_m)));
    }
  }
}

void DistanceGridBuilder::collect() {
  if (grid_->set_lattice(lattice_)) return;
  throw geometry::MeshError("mesh needs more distance samples than a grid can hold; enlarge cell_m or tolerance_m");
}

std::unique_ptr<DistanceGrid> DistanceGrid::build(const geometry::ContactMesh& mesh, const geometry::TriangleTree& tree,
                                                  const ContactShapeOptions& options,
                                                  const std::function<void(double)>& progress) {
  check(options);
  for (ContactShapeOptions fitting = options;;) {
    DistanceGridBuilder builder(mesh, tree, fitting, progress);
    const double excess =
        builder.lay_out(mesh.kind == geometry::SurfaceKind::kSolid) / static_cast<double>(options.max_grid_bytes);
    if (excess > 1) {
      // The number of bricks is proportional to the surface area divided by the square of a brick's edge.
      const double wider = std::sqrt(kWidenFor * excess);
      fitting.cell_m *= wider;
      fitting.tolerance_m *= wider;
      fitting.band_m = std::max(fitting.band_m, fitting.cell_m);
      continue;
    }
    std::unique_ptr<DistanceGrid> grid = builder.build();
    if (progress) progress(1.0);
    return grid;
  }
}

}  // namespace tandem::contact
