// Sampling the distance to a mesh: which bricks, how finely, and how their borders are made to agree. Every brick is
// sampled on its own, so threads share nothing and their number does not show in the result.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "common/contact/distance_grid.hpp"

namespace tandem::contact {
namespace {

constexpr int kBrickCells = 4;    ///< of the largest cells, along a brick's edge
constexpr int kFinestCells = 16;  ///< of the smallest; positions in bricks are counted in these
constexpr int kEdge = kFinestCells + 1;
constexpr std::size_t kMaxBricks = std::size_t{1} << 24U;
constexpr double kRounding = 1.001;  ///< what is equal to a length in exact numbers is shorter than that many of it
constexpr double kSampleSteps = std::numeric_limits<std::int16_t>::max();

void require(bool is_met, const char* field, double value, const char* remedy) {
  if (is_met) return;
  throw std::invalid_argument("distance grid: " + std::string(field) + " is " + std::to_string(value) + "; " + remedy);
}

void check(const DistanceGridOptions& options) {
  require(options.cell_m >= 1e-5 && options.cell_m <= 10, "cell_m", options.cell_m, "use 0.00001 to 10 m");
  require(options.tolerance_m > 0 && std::isfinite(options.tolerance_m), "tolerance_m", options.tolerance_m,
          "use a positive length");
  // Nearer to the surface than a cell's half diagonal, even the sign of an interpolated distance may be wrong.
  require(options.band_m >= options.cell_m && options.band_m <= 100, "band_m", options.band_m,
          "use at least cell_m and at most 100 m");
  require(options.sheet_thickness_m >= 0 && options.sheet_thickness_m <= 100, "sheet_thickness_m",
          options.sheet_thickness_m, "use 0 to 100 m");
  require(options.threads >= 1 && options.threads <= 256, "threads", options.threads, "use 1 to 256");
}

/// Calls work(i) for all i below `count` on `threads` threads, the calling one among them, which alone tells progress.
class Crew {
 public:
  Crew(int threads, const std::function<void(double)>& progress) : threads_(threads), progress_(progress) {}

  template <typename Work>
  void run(std::size_t count, double progress_from, double progress_to, const Work& work) const {
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::mutex failure_lock;
    const auto labour = [&](bool is_caller) {
      try {
        for (std::size_t i = next++; i < count; i = next++) {
          work(i);
          if (is_caller)
            tell(progress_from +
                 (progress_to - progress_from) * static_cast<double>(i + 1) / static_cast<double>(count));
        }
      } catch (...) {
        next = count;
        const std::scoped_lock lock(failure_lock);
        failure = std::current_exception();
      }
    };
    {
      std::vector<std::jthread> helpers;
      for (int i = 1; i < threads_; ++i) helpers.emplace_back(labour, false);
      labour(true);
    }
    if (failure) std::rethrow_exception(failure);
  }

 private:
  void tell(double done) const {
    if (progress_) progress_(done);
  }

  int threads_;
  const std::function<void(double)>& progress_;
};

/// Distance to the mesh as contact means it: signed for a solid, to the plate around a sheet.
class ExactDistance {
 public:
  ExactDistance(const geometry::TriangleTree& tree, geometry::SurfaceKind kind, double sheet_thickness_m)
      : tree_(tree), is_solid_(kind == geometry::SurfaceKind::kSolid), half_thickness_m_(sheet_thickness_m / 2) {}

  /// In      hint  triangle of a query nearby, or −1; replaced by this query's
  double operator()(const Vec3& p_S, int& hint) const {
    const geometry::TriangleTree::Closest closest = tree_.closest(p_S, std::numeric_limits<double>::infinity(), hint);
    hint = closest.triangle;
    if (!is_solid_) return closest.distance_m - half_thickness_m_;
    return (p_S - closest.point_S).dot(closest.normal_S) < 0 ? -closest.distance_m : closest.distance_m;
  }

 private:
  const geometry::TriangleTree& tree_;
  bool is_solid_;
  double half_thickness_m_;
};

/// One pseudo-normal at a flaw of the mesh, a tiny fold, must not turn the space around it inside out. Two neighbours
/// farther from the surface, together, than from each other are on the same side of it; all that hangs together like
/// this takes the sign that most of it has.
///
/// In      distances_m  on a lattice, x fastest, of `along` points
///         apart_m      how far neighbours are from each other, and more by what their distances err
void settle_signs(std::span<float> distances_m, const std::array<std::size_t, 3>& along, double apart_m) {
  const std::array<std::size_t, 3> strides = {1, along[0], along[0] * along[1]};
  std::vector<bool> is_reached(distances_m.size(), false);
  std::vector<std::size_t> region;
  const auto grow_from = [&](std::size_t from) {
    const auto visit = [&](std::size_t to) {
      if (is_reached[to] || std::abs(distances_m[from]) + std::abs(distances_m[to]) <= apart_m) return;
      is_reached[to] = true;
      region.push_back(to);
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t position = from / strides[axis] % along[axis];
      if (position > 0) visit(from - strides[axis]);
      if (position + 1 < along[axis]) visit(from + strides[axis]);
    }
  };
  for (std::size_t start = 0; start < distances_m.size(); ++start) {
    if (is_reached[start]) continue;
    region.assign(1, start);
    is_reached[start] = true;
    for (std::size_t i = 0; i < region.size(); ++i) grow_from(region[i]);
    const auto negative =
        std::count_if(region.begin(), region.end(), [&](std::size_t point) { return distances_m[point] < 0; });
    const float sign = 2 * static_cast<std::size_t>(negative) > region.size() ? -1.0F : 1.0F;
    for (const std::size_t point : region) distances_m[point] = std::copysign(distances_m[point], sign);
  }
}

/// A position in a brick, in half smallest cells: every middle of a cell, of a face or of an edge has one.
using Halves = std::array<int, 3>;
constexpr int kBrickHalves = 2 * kFinestCells;

/// Trilinear interpolation on a lattice of `step` halves.
///
/// In      corner  value at (x, y, z), in halves
template <typename Corner>
double interpolated(const Halves& at, int step, const Corner& corner) {
  Halves low;
  std::array<double, 3> part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(at[axis], kBrickHalves - step) / step * step;
    part[axis] = static_cast<double>(at[axis] - low[axis]) / step;
  }
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto along_x = [&](int y, int z) { return mix(corner(low[0], y, z), corner(low[0] + step, y, z), part[0]); };
  const auto along_y = [&](int z) { return mix(along_x(low[1], z), along_x(low[1] + step, z), part[1]); };
  return mix(along_y(low[2]), along_y(low[2] + step), part[2]);
}

constexpr int step_of(std::uint32_t level) {
  return kBrickHalves / (kBrickCells << level);
}

/// A place where the exact distance is known.
struct TestPoint {
  std::array<std::uint8_t, 3> at;  ///< halves
  float distance_m;
};

struct Brick {
  std::uint32_t index = 0;
  int hint = -1;
  std::uint32_t level = 0;
  std::vector<std::int16_t> samples;
  std::vector<TestPoint> tests;

  /// In halves, multiples of the level's step.
  std::size_t offset(int x, int y, int z) const {
    const int step = step_of(level);
    const int edge = kBrickHalves / step + 1;
    return static_cast<std::size_t>(((z / step) * edge + y / step) * edge + x / step);
  }
  /// In quanta.
  double interpolated_at(const Halves& at) const {
    return interpolated(at, step_of(level), [this](int x, int y, int z) { return samples[offset(x, y, z)]; });
  }
};

/// Samples one brick: ever finer where interpolation is not good enough in the middle of a cell. Elsewhere the finer
/// samples are what the coarser ones interpolate to, so that the work is where the surface bends.
class BrickSampler {
 public:
  BrickSampler(const ExactDistance& exact, const Vec3& low_S, double brick_m, int hint, double band_m)
      : exact_(exact), low_S_(low_S), half_m_(brick_m / kBrickHalves), band_m_(band_m), hint_(hint) {
    for_lattice(step_of(0), [this](const Halves& at) { known(at) = measured(at); });
    is_bad_.fill(true);
  }

  /// Samples down to the coarsest level that is good enough, and gives it.
  std::uint32_t refine(std::uint32_t levels, double tolerance_m) {
    std::uint32_t level = 0;
    while (has_bad_cells(step_of(level), tolerance_m) && level + 1 < levels) sample(++level);
    if (is_contradictory_ && level + 1 == levels) resolve_signs(tolerance_m);
    return level;
  }

  std::vector<std::int16_t> quantised(std::uint32_t level, double quantum_m) const {
    const int step = step_of(level);
    const auto edge = static_cast<std::size_t>(kBrickHalves / step + 1);
    std::vector<std::int16_t> samples;
    samples.reserve(edge * edge * edge);
    for_lattice(step, [&](const Halves& at) {
      const double steps = std::clamp(known_m_[offset(at)] / quantum_m, -kSampleSteps, kSampleSteps);
      samples.push_back(static_cast<std::int16_t>(std::lround(steps)));
    });
    return samples;
  }

  std::vector<TestPoint> take_tests() { return std::move(tests_); }

 private:
  template <typename Visit>
  static void for_lattice(int step, const Visit& visit) {
    for (int z = 0; z <= kBrickHalves; z += step) {
      for (int y = 0; y <= kBrickHalves; y += step) {
        for (int x = 0; x <= kBrickHalves; x += step) visit({x, y, z});
      }
    }
  }
  static std::size_t offset(const Halves& at) {
    return static_cast<std::size_t>(((at[2] / 2) * kEdge + at[1] / 2) * kEdge + at[0] / 2);
  }
  float& known(const Halves& at) { return known_m_[offset(at)]; }
  float measured(const Halves& at) {
    return static_cast<float>(exact_(low_S_ + Vec3(at[0], at[1], at[2]) * half_m_, hint_));
  }
  double guess(const Halves& at, int step) const {
    return interpolated(at, step, [this](int x, int y, int z) { return known_m_[offset({x, y, z})]; });
  }

  static std::size_t cell_of(const Halves& at, int step) {
    const auto along = [step](int position) { return std::min(position, kBrickHalves - 1) / step; };
    const int cells = kBrickHalves / step;
    return static_cast<std::size_t>((along(at[2]) * cells + along(at[1])) * cells + along(at[0]));
  }
  /// Whether one of the up to eight cells around a place is.
  bool is_at_bad_cell(const Halves& at, int step) const {
    for (int i = 0; i < 8; ++i) {
      Halves in_cell = at;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        in_cell[axis] = (i >> axis & 1) != 0 ? std::max(at[axis] - 1, 0) : std::min(at[axis], kBrickHalves - 1);
      }
      if (is_bad_[cell_of(in_cell, step)]) return true;
    }
    return false;
  }

  void sample(std::uint32_t level) {
    const int step = step_of(level);
    for_lattice(step, [&](const Halves& at) {
      const auto is_between = [&](int position) { return position % (2 * step) != 0; };
      const bool is_middle = is_between(at[0]) && is_between(at[1]) && is_between(at[2]);
      const bool is_new = is_between(at[0]) || is_between(at[1]) || is_between(at[2]);
      if (!is_new || (is_middle && is_tested_[cell_of(at, 2 * step)])) return;
      known(at) = is_at_bad_cell(at, 2 * step) ? measured(at) : static_cast<float>(guess(at, 2 * step));
    });
  }

  /// Tests the cells of a level within the bad ones of the level before, and remembers which are bad themselves: in
  /// their middles, and in the middles of faces on the brick's border, which finer neighbours are going to follow.
  bool has_bad_cells(int step, double tolerance_m) {
    const std::array<bool, kMaxCells> was_bad = is_bad_;
    is_bad_.fill(false);
    is_tested_.fill(false);
    bool has_bad = false;
    for_lattice(step / 2, [&](const Halves& at) {
      int middles = 0;
      int borders = 0;
      for (const int position : at) {
        middles += position % step != 0 ? 1 : 0;
        borders += position == 0 || position == kBrickHalves ? 1 : 0;
      }
      if (middles + borders < 3 || middles < 2) return;
      if (step != step_of(0) && !was_bad[cell_of(at, 2 * step)]) return;
      has_bad = is_bad_at(at, step, tolerance_m) || has_bad;
    });
    return has_bad;
  }

  bool is_bad_at(const Halves& at, int step, double tolerance_m) {
    // The interpolation of a distance errs by half a cell's diagonal at most, and the cell reaches as far.
    const double reach_m = 0.5 * std::sqrt(3.0) * step * half_m_;
    const double interpolated_m = guess(at, step);
    if (std::abs(interpolated_m) > band_m_ + 2 * reach_m) return false;
    const float exact_m = measured(at);
    if (std::abs(exact_m) <= band_m_) {
      const auto small = [](int position) { return static_cast<std::uint8_t>(position); };
      tests_.push_back({{small(at[0]), small(at[1]), small(at[2])}, exact_m});
    }
    const double error_m = std::abs(interpolated_m - exact_m);
    // Interpolation errs by more than it can: one of these distances has the wrong sign.
    const bool is_contradiction = error_m > kRounding * reach_m;
    is_contradictory_ = is_contradictory_ || is_contradiction;
    const bool is_bad = is_contradiction || (std::abs(exact_m) <= band_m_ + reach_m && error_m > tolerance_m);
    if (step == 2) return is_bad;
    if (at[0] % step != 0 && at[1] % step != 0 && at[2] % step != 0) {
      // It is a sample of the next level.
      known(at) = exact_m;
      is_tested_[cell_of(at, step)] = true;
    }
    if (is_bad) mark_bad(at, step, error_m > kCrease * tolerance_m);
    return is_bad;
  }

  /// An error as large as that of a crease, which may cross the cells around without their middles showing it.
  void mark_bad(const Halves& at, int step, bool with_neighbours) {
    is_bad_[cell_of(at, step)] = true;
    if (!with_neighbours) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int side : {-step, step}) {
        Halves beside = at;
        beside[axis] += side;
        if (beside[axis] >= 0 && beside[axis] < kBrickHalves) is_bad_[cell_of(beside, step)] = true;
      }
    }
  }

  /// At the finest level.
  void resolve_signs(double tolerance_m) {
    const int step = 2;
    settle_signs(known_m_, {kEdge, kEdge, kEdge}, kRounding * step * half_m_ + 2 * tolerance_m);
    for (TestPoint& test : tests_) {
      const double interpolated_m = guess({test.at[0], test.at[1], test.at[2]}, step);
      if (std::abs(interpolated_m + test.distance_m) < std::abs(interpolated_m - test.distance_m))
        test.distance_m *= -1;
    }
  }

  static constexpr double kCrease = 3.0;               ///< times the tolerance; by trial on the bunny and on boxes
  static constexpr std::size_t kMaxCells = 8 * 8 * 8;  ///< of a level that has a finer one

  const ExactDistance& exact_;
  Vec3 low_S_;
  double half_m_;
  double band_m_;
  int hint_;
  std::array<float, kEdge * kEdge * kEdge> known_m_;
  std::array<bool, kMaxCells> is_bad_;
  std::array<bool, kMaxCells> is_tested_;
  bool is_contradictory_ = false;
  std::vector<TestPoint> tests_;
};

}  // namespace

class DistanceGridBuilder {
 public:
  DistanceGridBuilder(const geometry::ContactMesh& mesh, const geometry::TriangleTree& tree,
                      const DistanceGridOptions& options, const std::function<void(double)>& progress)
      : options_(options),
        exact_(tree, mesh.kind, options.sheet_thickness_m),
        crew_(options.threads, progress),
        grid_(new DistanceGrid) {
    lay_lattice(mesh);
  }

  std::unique_ptr<DistanceGrid> build(bool is_solid) {
    measure_corners();
    if (is_solid)
      settle_signs(grid_->corners_m_, {corners_along(0), corners_along(1), corners_along(2)},
                   kRounding * grid_->brick_m_);
    find_bricks();
    sample_bricks();
    for (std::uint32_t level = 0; level < DistanceGrid::kLevels; ++level) match_borders(level);
    measure_error();
    collect();
    return std::move(grid_);
  }

 private:
  void lay_lattice(const geometry::ContactMesh& mesh);
  void measure_corners();
  void find_bricks();
  void sample_bricks();
  void match_borders(std::uint32_t level);
  void match_border(Brick& brick) const;
  const Brick* owner_of(const Brick& brick, const Halves& at, Halves& at_owner) const;
  void measure_error();
  void collect();
  Vec3 corner_S(std::size_t x, std::size_t y, std::size_t z) const {
    return grid_->origin_S_ +
           Vec3(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) * grid_->brick_m_;
  }
  std::size_t corners_along(std::size_t axis) const { return std::size_t{grid_->bricks_[axis]} + 1; }
  std::array<std::uint32_t, 3> position_of(std::uint32_t index) const {
    const auto& [nx, ny, nz] = grid_->bricks_;
    return {index % nx, index / nx % ny, index / nx / ny};
  }
  std::uint32_t index_of(const std::array<std::uint32_t, 3>& position) const {
    return (position[2] * grid_->bricks_[1] + position[1]) * grid_->bricks_[0] + position[0];
  }

  DistanceGridOptions options_;
  ExactDistance exact_;
  Crew crew_;
  std::unique_ptr<DistanceGrid> grid_;
  std::vector<Brick> bricks_;
  std::vector<std::int32_t> brick_at_;  ///< for each brick of the lattice, its place in bricks_ or −1
};

void DistanceGridBuilder::lay_lattice(const geometry::ContactMesh& mesh) {
  DistanceGrid& grid = *grid_;
  Vec3 low = mesh.mesh.vertices.at(static_cast<std::size_t>(mesh.mesh.triangles.at(0)[0]));
  Vec3 high = low;
  for (const auto& triangle : mesh.mesh.triangles) {
    for (const int vertex : triangle) {
      low = low.cwiseMin(mesh.mesh.vertices[static_cast<std::size_t>(vertex)]);
      high = high.cwiseMax(mesh.mesh.vertices[static_cast<std::size_t>(vertex)]);
    }
  }
  const double thickness = mesh.kind == geometry::SurfaceKind::kSheet ? options_.sheet_thickness_m / 2 : 0.0;
  grid.low_S_ = low.array() - thickness;
  grid.high_S_ = high.array() + thickness;
  grid.brick_m_ = kBrickCells * options_.cell_m;
  grid.bricks_per_m_ = 1.0 / grid.brick_m_;
  grid.band_m_ = options_.band_m;
  // The farthest sample is half a brick's diagonal beyond the farthest middle of a brick.
  grid.quantum_m_ = (grid.band_m_ + grid.brick_m_ * std::sqrt(3.0)) / kSampleSteps;
  // Around it, as much space as the band takes, and a brick more: the border is outside and not near.
  const double margin = grid.band_m_ + grid.brick_m_;
  const Vec3 size = grid.high_S_ - grid.low_S_ + Vec3::Constant(2 * margin);
  const Vec3 counts = (size * grid.bricks_per_m_).array().ceil();
  if (!(counts.prod() <= static_cast<double>(kMaxBricks)) || !is_finite(size)) {
    throw geometry::MeshError("mesh is " + std::to_string((high - low).maxCoeff()) +
                              " m long: too large for cells of " + std::to_string(options_.cell_m) +
                              " m; is its unit metres? Scale it, or enlarge cell_m");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.bricks_[axis] = static_cast<std::uint32_t>(counts[static_cast<Eigen::Index>(axis)]);
  }
  grid.origin_S_ = 0.5 * (low + high - counts * grid.brick_m_);
}

void DistanceGridBuilder::measure_corners() {
  grid_->corners_m_.resize(grid_->corner_total());
  const std::size_t nx = corners_along(0);
  const std::size_t ny = corners_along(1);
  crew_.run(corners_along(2), 0.0, 0.1, [&](std::size_t z) {
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
  const auto& [nx, ny, nz] = grid_->bricks_;
  const double diagonal_m = grid_->brick_m_ * std::sqrt(3.0);
  std::vector<std::vector<Brick>> layers(nz);
  crew_.run(nz, 0.1, 0.15, [&](std::size_t z) {
    for (std::size_t y = 0; y < ny; ++y) {
      int hint = -1;
      for (std::size_t x = 0; x < nx; ++x) {
        const double corner_m = grid_->corners_m_[(z * (ny + 1) + y) * (nx + 1) + x];
        if (std::abs(corner_m) > grid_->band_m_ + diagonal_m) continue;
        const Vec3 middle_S = corner_S(x, y, z) + Vec3::Constant(0.5 * grid_->brick_m_);
        if (std::abs(exact_(middle_S, hint)) > grid_->band_m_ + 0.5 * diagonal_m) continue;
        Brick brick;
        brick.index =
            index_of({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z)});
        brick.hint = hint;
        layers[z].push_back(std::move(brick));
      }
    }
  });
  brick_at_.assign(grid_->brick_total(), -1);
  for (std::vector<Brick>& layer : layers) {
    for (Brick& brick : layer) {
      brick_at_[brick.index] = static_cast<std::int32_t>(bricks_.size());
      bricks_.push_back(std::move(brick));
    }
  }
}

void DistanceGridBuilder::sample_bricks() {
  crew_.run(bricks_.size(), 0.15, 0.97, [&](std::size_t i) {
    Brick& brick = bricks_[i];
    const auto [x, y, z] = position_of(brick.index);
    BrickSampler sampler(exact_, corner_S(x, y, z), grid_->brick_m_, brick.hint, grid_->band_m_);
    brick.level = sampler.refine(DistanceGrid::kLevels, options_.tolerance_m);
    brick.samples = sampler.quantised(brick.level, grid_->quantum_m_);
    brick.tests = sampler.take_tests();
  });
}

/// A place that several bricks share is owned by the coarsest of them, of those the first; the samples that the others
/// have there become what the owner interpolates to. All coarser levels have been matched.
void DistanceGridBuilder::match_borders(std::uint32_t level) {
  crew_.run(bricks_.size(), 0.97 + 0.01 * level, 0.98 + 0.01 * level, [&](std::size_t i) {
    if (bricks_[i].level == level) match_border(bricks_[i]);
  });
}

void DistanceGridBuilder::match_border(Brick& brick) const {
  const int step = step_of(brick.level);
  const auto is_border = [](int position) { return position == 0 || position == kBrickHalves; };
  for (int z = 0; z <= kBrickHalves; z += step) {
    for (int y = 0; y <= kBrickHalves; y += step) {
      const int stride = is_border(z) || is_border(y) ? step : kBrickHalves;
      for (int x = 0; x <= kBrickHalves; x += stride) {
        Halves at_owner{};
        const Brick* owner = owner_of(brick, {x, y, z}, at_owner);
        if (owner == &brick) continue;
        // Of the same level it has a sample there. It alone may be looked at: others of its own are being matched.
        brick.samples[brick.offset(x, y, z)] =
            owner->level == brick.level ? owner->samples[owner->offset(at_owner[0], at_owner[1], at_owner[2])]
                                        : static_cast<std::int16_t>(std::lround(owner->interpolated_at(at_owner)));
      }
    }
  }
}

/// The owner of a place on the border of `brick`, and where in the owner that is.
const Brick* DistanceGridBuilder::owner_of(const Brick& brick, const Halves& at, Halves& at_owner) const {
  const auto position = position_of(brick.index);
  const Brick* owner = &brick;
  for (int i = 1; i < 8; ++i) {
    std::array<std::uint32_t, 3> beside = position;
    Halves at_beside = at;
    bool is_there = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((i >> axis & 1) == 0) continue;
      const bool is_low = at[axis] == 0;
      // Below 0 the position wraps around, and is out of the lattice too.
      beside[axis] += is_low ? ~0U : 1U;
      at_beside[axis] = is_low ? kBrickHalves : 0;
      is_there = is_there && (is_low || at[axis] == kBrickHalves) && beside[axis] < grid_->bricks_[axis];
    }
    const std::int32_t place = is_there ? brick_at_[index_of(beside)] : -1;
    if (place < 0) continue;
    const Brick& other = bricks_[static_cast<std::size_t>(place)];
    if (std::pair(other.level, other.index) >= std::pair(owner->level, owner->index)) continue;
    owner = &other;
    at_owner = at_beside;
  }
  return owner;
}

void DistanceGridBuilder::measure_error() {
  for (const Brick& brick : bricks_) {
    for (const TestPoint& test : brick.tests) {
      const double interpolated_m = brick.interpolated_at({test.at[0], test.at[1], test.at[2]}) * grid_->quantum_m_;
      grid_->error_m_ = std::max(grid_->error_m_, std::abs(interpolated_m - static_cast<double>(test.distance_m)));
    }
  }
}

void DistanceGridBuilder::collect() {
  std::vector<std::uint8_t> levels(grid_->brick_total(), 0);
  std::size_t count = 0;
  for (const Brick& brick : bricks_) {
    levels[brick.index] = static_cast<std::uint8_t>(brick.level + 1);
    count += brick.samples.size();
  }
  if (!grid_->set_levels(levels, count)) {
    throw geometry::MeshError("mesh needs " + std::to_string(count) +
                              " distance samples, more than a grid can hold; enlarge cell_m or "
                              "tolerance_m");
  }
  grid_->samples_.reserve(count);
  for (const Brick& brick : bricks_)
    grid_->samples_.insert(grid_->samples_.end(), brick.samples.begin(), brick.samples.end());
}

std::unique_ptr<DistanceGrid> DistanceGrid::build(const geometry::ContactMesh& mesh, const geometry::TriangleTree& tree,
                                                  const DistanceGridOptions& options,
                                                  const std::function<void(double)>& progress) {
  check(options);
  std::unique_ptr<DistanceGrid> grid =
      DistanceGridBuilder(mesh, tree, options, progress).build(mesh.kind == geometry::SurfaceKind::kSolid);
  if (progress) progress(1.0);
  return grid;
}

}  // namespace tandem::contact
