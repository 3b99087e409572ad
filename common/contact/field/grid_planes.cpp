// Finds the blocks (parts of bricks, see PlaneMap) of a grid whose samples equal the distance to a plane, or the
// largest of the distances to a few planes.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/contact/field/brick_sampler.hpp"
#include "common/contact/field/distance_grid.hpp"
#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {
namespace {

// Largest difference between a sample and the distance to a plane, before and after the plane is fitted, in
// quantization steps of samples near the surface. Rounding causes half a step. Another half step occurs where a brick
// takes over the samples on the border of a coarser brick.
constexpr double kGuessSteps = 3;
constexpr double kFittedSteps = 1.25;
// Additional tolerance before and after the plane is fitted, as a fraction of the distance. Far from the surface,
// samples are rounded to 1/128 of their distance.
constexpr double kGuessShare = 0.01;
constexpr double kFittedShare = 0.005;
// Least number of samples for a fit. With fewer samples, the plane estimated from the shell's points is as accurate.
constexpr double kMinSamples = 64;
// Additional tolerance where several planes meet. At sharp edges between bricks of different resolution, samples have
// errors up to this value, and the planes are more accurate.
constexpr double kEdge_m = 1e-4;
// Largest number of bricks of a grid for which planes are searched. For planes, each brick needs 12 bytes of memory and
// some time.
constexpr std::size_t kMaxBricksWithPlanes = std::size_t{1} << 20U;
// Limit of the total number of distances to planes that are computed, which takes a few seconds. When it is reached,
// the remaining blocks get no planes.
constexpr std::int64_t kMaxDistances = 500'000'000;
// Distance from the surface beyond which a block counts as outside.
constexpr double kOutside_m = 3e-4;
// Depth beyond which a sample need not match any plane, because no contact is as deep (see PlaneMap::kDeep_m).
constexpr double kInside_m = 2 * PlaneMap::kDeep_m;

/// Least-squares fit of a plane to samples. Corrects the normal and offset of an approximate plane so that the sum of
/// the squared residuals is smallest.
struct Fit {
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  Eigen::Vector4d rest = Eigen::Vector4d::Zero();

  void add(const Vec3& p, double rest_m) {
    const Eigen::Vector4d a(p.x(), p.y(), p.z(), 1);
    squares += a * a.transpose();
    rest += rest_m * a;
  }
  /// In      origin  reference point of the positions passed to add()
  FieldPlane corrected(const FieldPlane& plane, const Vec3& origin) const {
    const double count = squares(3, 3);
    if (count < kMinSamples) return plane;
    Eigen::Matrix4d damped = squares;
    const Vec3 mean = squares.topRightCorner<3, 1>() / count;
    const double spread = squares.topLeftCorner<3, 3>().trace() / count - mean.squaredNorm();
    damped.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity() * (1e-6 * count * spread);
    const Eigen::Vector4d change = damped.ldlt().solve(rest);
    if (!change.allFinite()) return plane;
    FieldPlane fitted{plane.normal + change.head<3>(), 0};
    fitted.offset_m = plane.offset_m + change[3] - change.head<3>().dot(origin);
    const double length = fitted.normal.norm();
    if (!(std::abs(length - 1) < 0.1)) return plane;
    // The fitted normal is not exactly of unit length. Dividing normal and offset by its length does not move the
    // plane.
    return {fitted.normal / length, fitted.offset_m / length};
  }
};

}  // namespace

class DistanceGrid::PlaneFinder {
 public:
  PlaneFinder(const DistanceGrid& grid, std::vector<FieldPlane> planes)
      : grid_(grid), step_m_(grid.sample_step_ * grid.quantum_m_), planes_(std::move(planes)) {}

  /// A cube of neighbouring blocks in one brick.
  struct Blocks {
    std::array<std::uint32_t, 3> first;
    std::uint32_t along;
  };
  static constexpr Blocks kWhole{{0, 0, 0}, PlaneMap::kBlocks};

  PlaneMap found() {
    fit();
    PlaneMap map(planes_, grid_.origin_S_, grid_.bricks_, grid_.brick_m_);
    for_bricks([&](std::size_t brick, const Vec3& low_S, std::uint32_t ref) {
      PlaneMap::Blocks blocks{};
      if (ref == 0) {
        blocks.fill(far_index(low_S));
      } else {
        blocks.fill(index_of(map, low_S, ref, kWhole));
        if (blocks[0] == PlaneMap::kNone) {
          for_blocks([&](std::size_t block, const Blocks& at) { blocks[block] = index_of(map, low_S, ref, at); });
        }
      }
      map.set(brick, blocks);
    });
    return map;
  }

 private:
  void fit() {
    std::vector<Fit> fits(planes_.size());
    for_bricks([&](std::size_t, const Vec3& low_S, std::uint32_t ref) {
      if (ref == 0) return;
      for_planes(low_S, [&](std::size_t i) {
        if (is_on(planes_[i], low_S, ref, kWhole, kGuessSteps, kGuessShare)) add(low_S, ref, kWhole, i, fits[i]);
      });
    });
    for (std::size_t i = 0; i < planes_.size(); ++i) planes_[i] = fits[i].corrected(planes_[i], grid_.origin_S_);
  }

  void add(const Vec3& low_S, std::uint32_t ref, const Blocks& blocks, std::size_t plane, Fit& fit) const {
    for_samples(low_S, ref, blocks, [&](const Vec3& p_S, double sample_m) {
      // Only samples next to the surface are used, which are the most accurate.
      if (std::abs(sample_m) < grid_.brick_m_ / kBrickCells) {
        fit.add(p_S - grid_.origin_S_, sample_m - planes_[plane].distance_m(p_S));
      }
      return true;
    });
  }

  template <typename Visit>
  void for_bricks(const Visit& visit) const {
    for (std::size_t i = 0; i < grid_.refs_.size(); ++i) {
      const std::size_t x = i % grid_.bricks_[0], y = i / grid_.bricks_[0] % grid_.bricks_[1],
                        z = i / grid_.bricks_[0] / grid_.bricks_[1];
      const Vec3 index(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
      visit(i, Vec3(grid_.origin_S_ + grid_.brick_m_ * index), grid_.refs_[i]);
    }
  }

  /// Calls visit(i) for the index of each plane that may be near a brick.
  template <typename Visit>
  void for_planes(const Vec3& low_S, const Visit& visit) const {
    const Vec3 middle = low_S + Vec3::Constant(grid_.brick_m_ / 2);
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      if (std::abs(planes_[i].distance_m(middle)) <= grid_.band_m_ + grid_.brick_m_) visit(i);
    }
  }

  template <typename Visit>
  static void for_blocks(const Visit& visit) {
    std::size_t block = 0;
    for (std::uint32_t z = 0; z < PlaneMap::kBlocks; ++z) {
      for (std::uint32_t y = 0; y < PlaneMap::kBlocks; ++y) {
        for (std::uint32_t x = 0; x < PlaneMap::kBlocks; ++x) visit(block++, Blocks{{x, y, z}, 1});
      }
    }
  }

  /// Returns whether visit(p_S, sample) is true for all samples in a cube of blocks and on its faces. If blocks are
  /// smaller than cells, the samples at the corners of the surrounding cells are used.
  template <typename Visit>
  bool for_samples(const Vec3& low_S, std::uint32_t ref, const Blocks& blocks, const Visit& visit) const {
    const std::uint32_t cells = cells_of(level_of(ref));
    const auto begin = [&](std::size_t axis) { return blocks.first[axis] * cells / PlaneMap::kBlocks; };
    const auto last = [&](std::size_t axis) {
      return std::max(begin(axis) + 1, (blocks.first[axis] + blocks.along) * cells / PlaneMap::kBlocks);
    };
    const std::size_t row = cells + 1;
    const std::int16_t* const samples = &grid_.samples_[ref >> kLevelBits];
    for (std::uint32_t z = begin(2); z <= last(2); ++z) {
      for (std::uint32_t y = begin(1); y <= last(1); ++y) {
        for (std::uint32_t x = begin(0); x <= last(0); ++x) {
          const Vec3 p_S = low_S + grid_.brick_m_ / cells * Vec3(x, y, z);
          if (!visit(p_S, grid_.quantum_m_ * samples[(z * row + y) * row + x])) return false;
        }
      }
    }
    return true;
  }

  bool is_on(const FieldPlane& plane, const Vec3& low_S, std::uint32_t ref, const Blocks& blocks, double steps,
             double share) const {
    return for_samples(low_S, ref, blocks, [&](const Vec3& p_S, double sample_m) {
      return std::abs(sample_m - plane.distance_m(p_S)) <= steps * step_m_ + share * std::abs(sample_m);
    });
  }

  static std::uint8_t far_index(double least_m, double most_m) {
    if (least_m >= kOutside_m) return PlaneMap::kOutside;
    return most_m <= -kInside_m ? PlaneMap::kInside : PlaneMap::kNone;
  }
  /// Returns the index in PlaneMap for a brick without samples.
  std::uint8_t far_index(const Vec3& low_S) const {
    double least_m = std::numeric_limits<double>::infinity(), most_m = -least_m;
    for (const double z : {0.25, 0.75}) {
      for (const double y : {0.25, 0.75}) {
        for (const double x : {0.25, 0.75}) {
          const double distance = grid_.distance_m(low_S + grid_.brick_m_ * Vec3(x, y, z));
          least_m = std::min(least_m, distance);
          most_m = std::max(most_m, distance);
        }
      }
    }
    return far_index(least_m, most_m);
  }

  /// Returns the value of PlaneMap that all blocks of a cube share: the index of a set of planes that matches all
  /// samples in the cube, kOutside, kInside, or kNone if there is no such set.
  std::uint8_t index_of(PlaneMap& map, const Vec3& low_S, std::uint32_t ref, const Blocks& blocks) {
    if (distances_left_ < 0) return PlaneMap::kNone;
    PlaneSet set = 0;
    const bool is_known = for_samples(low_S, ref, blocks, [&](const Vec3& p_S, double sample_m) {
      if (matches(set, p_S, sample_m)) return true;
      distances_left_ -= static_cast<std::int64_t>(planes_.size());
      bool is_found = false;
      // Beside an edge, outside of the shape, the distance to the shape is larger than the distance to each plane. If
      // no single plane matches such a sample, the set of all planes with a positive distance is tried.
      PlaneSet beyond = set;
      for_planes(low_S, [&](std::size_t i) {
        const PlaneSet wider = set | PlaneSet{1} << i;
        if (planes_[i].distance_m(p_S) > 0) beyond |= PlaneSet{1} << i;
        if (is_found || !matches(wider, p_S, sample_m)) return;
        is_found = true;
        set = wider;
      });
      if (!is_found && matches(beyond, p_S, sample_m)) {
        is_found = true;
        set = beyond;
      }
      is_found = is_found || sample_m <= -kInside_m;
      return is_found && std::popcount(set) <= PlaneMap::kMaxInBlock;
    });
    const auto all_match = [&](const Vec3& p_S, double sample_m) {
      return matches(set, p_S, sample_m) ||
             (sample_m <= -kInside_m && largest_m(planes_, set, p_S) <= -PlaneMap::kDeep_m);
    };
    if (is_known && set != 0 && for_samples(low_S, ref, blocks, all_match)) return map.index_of(set);
    double least_m = std::numeric_limits<double>::infinity(), most_m = -least_m;
    for_samples(low_S, ref, blocks, [&](const Vec3&, double sample_m) {
      least_m = std::min(least_m, sample_m);
      most_m = std::max(most_m, sample_m);
      return true;
    });
    return far_index(least_m, most_m);
  }

  /// Returns whether a sample equals the largest distance to the planes. Outside of an edge, where several planes meet,
  /// a larger sample matches, too.
  bool matches(PlaneSet set, const Vec3& p_S, double sample_m) {
    distances_left_ -= 1 + std::popcount(set);
    const double largest = largest_m(planes_, set, p_S);
    const double error_m = sample_m - largest;
    const bool is_edge = std::popcount(set) > 1;
    const double most_m = kFittedSteps * step_m_ + kFittedShare * std::abs(sample_m) +
                          (is_edge ? std::min(kEdge_m, 2 * grid_.error_m_) : 0);
    return std::abs(error_m) <= most_m || (is_edge && largest > 0 && error_m > 0);
  }

  const DistanceGrid& grid_;
  double step_m_;
  std::vector<FieldPlane> planes_;
  std::int64_t distances_left_ = kMaxDistances;
};

void DistanceGrid::find_planes(std::vector<FieldPlane> guesses) {
  if (!guesses.empty() && refs_.size() <= kMaxBricksWithPlanes)
    planes_ = PlaneFinder(*this, std::move(guesses)).found();
}

}  // namespace tandem::contact
