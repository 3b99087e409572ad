#include "common/contact/field/plane_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {
namespace {

// Maximum number of bricks whose blocks have different sets of planes. This many need 32 MB.
constexpr std::size_t kMaxMixed = std::size_t{1} << 16U;
// Two signed distances to planes count as equal if their difference is at most this value.
constexpr double kSameDistance_m = 5e-6;
// Maximum number of bricks and blocks that a query may read, to bound its cost. A query that would read more returns no
// planes. The contact search then queries the children of its node instead.
constexpr std::size_t kMaxPlaneMapQueries = 512;

/// Calls visit(p) for the corners of a box until it returns false. Returns whether visit(p) was true for all corners.
template <typename Visit>
bool for_corners(const Vec3& middle, const Eigen::Matrix3d& half_edges, const Visit& visit) {
  for (const double z : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double x : {-1.0, 1.0}) {
        if (!visit(Vec3(middle + half_edges * Vec3(x, y, z)))) return false;
      }
    }
  }
  return true;
}

}  // namespace

/// Range of lattice cubes of one size that may intersect a box.
struct PlaneMap::Range {
  double edge_m;
  Vec3 origin;
  Vec3 most;  ///< largest distance of the centre of an intersecting cube from the centre of the box, along the box's
              ///< axes
  std::array<std::int64_t, 3> begin, end;

  /// Calls visit(x, y, z, middle) for the cubes until it returns false. Returns whether visit() was true for all cubes.
  template <typename Visit>
  bool all_of(const OrientedBox& box, const Visit& visit) const {
    const Vec3 step = edge_m * box.axes.row(0).transpose();
    const Vec3 per_step = step.cwiseInverse(), reach = (most.array() * per_step.array().abs()).matrix();
    for (std::int64_t z = begin[2]; z < end[2]; ++z) {
      for (std::int64_t y = begin[1]; y < end[1]; ++y) {
        const Vec3 row = origin + edge_m * Vec3(0.5, static_cast<double>(y) + 0.5, static_cast<double>(z) + 0.5);
        const Vec3 at = box.axes.transpose() * (row - box.centre);
        // Finds the cubes of this row that may intersect the box: the range of x for which |at + x · step| ≤ most along
        // each axis of the box.
        auto low = static_cast<double>(begin[0]), high = static_cast<double>(end[0] - 1);
        for (int i = 0; i < 3; ++i) {
          if (std::abs(step[i]) < 1e-9 * edge_m) {
            if (std::abs(at[i]) > most[i]) high = -1;
            continue;
          }
          const double middle = -at[i] * per_step[i];
          low = std::max(low, middle - reach[i]);
          high = std::min(high, middle + reach[i]);
        }
        if (!(low <= high)) continue;
        const auto last = static_cast<std::int64_t>(std::floor(high));
        for (auto x = static_cast<std::int64_t>(std::ceil(low)); x <= last; ++x) {
          if (!visit(x, y, z, Vec3(row + edge_m * static_cast<double>(x) * Vec3::UnitX()))) return false;
        }
      }
    }
    return true;
  }
};

PlaneMap::PlaneMap(std::vector<FieldPlane> planes, const Vec3& origin_S, const std::array<std::uint32_t, 3>& bricks,
                   double brick_m)
    : planes_(std::move(planes)), sets_{0, 0, 0}, origin_S_(origin_S), bricks_(bricks), brick_m_(brick_m) {
  refs_.resize(std::size_t{bricks[0]} * bricks[1] * bricks[2]);
  harmless_.resize(refs_.size());
}

std::uint8_t PlaneMap::index_of(PlaneSet set) {
  if (set == 0) return kNone;
  const auto found = std::find(sets_.begin() + 3, sets_.end(), set);
  if (found == sets_.end() && sets_.size() == kFirstMixed) return kNone;
  const auto index = static_cast<std::uint8_t>(found - sets_.begin());
  if (found == sets_.end()) sets_.push_back(set);
  return index;
}

void PlaneMap::set(std::size_t brick, const Blocks& blocks) {
  if (std::ranges::all_of(blocks, [&](std::uint8_t block) { return block == blocks[0]; })) {
    refs_[brick] = blocks[0];
    harmless_[brick] = harmless_in(blocks[0], middle_of(brick), brick_m_);
    return;
  }
  if (mixed_.size() == kMaxMixed) return;
  refs_[brick] = kFirstMixed + static_cast<std::uint32_t>(mixed_.size());
  mixed_.push_back(blocks);
}

Vec3 PlaneMap::middle_of(std::size_t brick) const {
  const std::size_t x = brick % bricks_[0], y = brick / bricks_[0] % bricks_[1], z = brick / bricks_[0] / bricks_[1];
  const Vec3 place(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5, static_cast<double>(z) + 0.5);
  return origin_S_ + brick_m_ * place;
}

PlaneSet PlaneMap::harmless_in(std::uint8_t index, const Vec3& middle, double edge_m) const {
  PlaneSet harmless = 0;
  if (index == kNone || index == kInside) return harmless;
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const PlaneSet plane = PlaneSet{1} << i;
    const double above_m = planes_[i].distance_m(middle) - edge_m / 2 * planes_[i].normal.cwiseAbs().sum();
    const bool is_harmless = index == kOutside ? above_m >= 0 : is_below(plane, sets_[index], middle, edge_m);
    if (is_harmless) harmless |= plane;
  }
  return harmless;
}

bool PlaneMap::is_largest(PlaneSet all, std::uint8_t index, const Vec3& middle, double edge_m) const noexcept {
  if (index == kOutside) return is_above_some(all, middle, Vec3::Constant(edge_m / 2));
  if (index == kInside) return is_deep(all, middle, edge_m);
  return is_below(all & ~sets_[index], sets_[index], middle, edge_m);
}

// Quick test before is_largest(), at one point of the block. False: the planes cannot replace the field in the block.
// True: they may.
bool PlaneMap::is_largest_at(PlaneSet all, std::uint8_t index, const Vec3& p_S) const noexcept {
  if (index <= kInside || (all & ~sets_[index]) == 0) return true;
  return largest_m(planes_, all & ~sets_[index], p_S) <= largest_m(planes_, sets_[index], p_S) + kSameDistance_m;
}

std::size_t PlaneMap::memory_bytes() const {
  return planes_.capacity() * sizeof(FieldPlane) + sets_.capacity() * sizeof(PlaneSet) +
         refs_.capacity() * sizeof(refs_[0]) + mixed_.capacity() * sizeof(Blocks) +
         harmless_.capacity() * sizeof(PlaneSet);
}

// Returns the range of cubes that may intersect a box. The range is limited to the lattice: for a box outside the
// lattice, it contains the cubes at the lattice's border.
PlaneMap::Range PlaneMap::range_of(const OrientedBox& box_S, double edge_m) const noexcept {
  Range range{edge_m, origin_S_, box_S.half_m + edge_m / 2 * box_S.axes.cwiseAbs().colwise().sum().transpose(), {}, {}};
  const Vec3 reach = box_S.axes.cwiseAbs() * box_S.half_m;
  const Vec3 low = (box_S.centre - reach - origin_S_) / edge_m;
  const Vec3 high = (box_S.centre + reach - origin_S_) / edge_m;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const double most = std::round(bricks_[axis] * brick_m_ / edge_m);
    range.begin[axis] = static_cast<std::int64_t>(std::floor(std::clamp(low[i], 0.0, most)));
    range.end[axis] = static_cast<std::int64_t>(std::clamp(std::floor(high[i]) + 1, 0.0, most));
  }
  return range;
}

std::uint8_t PlaneMap::at(const Vec3& p_S) const noexcept {
  const Vec3 scaled = (p_S - origin_S_) * (1 / brick_m_);
  for (int i = 0; i < 3; ++i) {
    if (!(scaled[i] >= 0 && scaled[i] < bricks_[static_cast<std::size_t>(i)])) return kOutside;
  }
  const auto x = static_cast<std::size_t>(scaled[0]), y = static_cast<std::size_t>(scaled[1]),
             z = static_cast<std::size_t>(scaled[2]);
  const std::uint32_t ref = refs_[(z * bricks_[1] + y) * bricks_[0] + x];
  if (ref < kFirstMixed) return static_cast<std::uint8_t>(ref);
  const auto block = [](double part) {
    return std::min<std::size_t>(static_cast<std::size_t>(part * kBlocks), kBlocks - 1);
  };
  return mixed_[ref - kFirstMixed]
               [(block(scaled[2] - static_cast<double>(z)) * kBlocks + block(scaled[1] - static_cast<double>(y))) *
                    kBlocks +
                block(scaled[0] - static_cast<double>(x))];
}

/// Visits the bricks in a box until a visit returns false. Calls of_brick(brick) for a brick whose blocks share one
/// index, and of_block(index, middle) for each block of other bricks. Returns whether all visits returned true.
template <typename OfBrick, typename OfBlock>
bool PlaneMap::for_blocks(const OrientedBox& box_S, const OfBrick& of_brick, const OfBlock& of_block) const noexcept {
  const Range bricks = range_of(box_S, brick_m_);
  const Range blocks = range_of(box_S, brick_m_ / kBlocks);
  return bricks.all_of(box_S, [&](std::int64_t x, std::int64_t y, std::int64_t z, const Vec3&) {
    const auto index = static_cast<std::size_t>((z * bricks_[1] + y) * bricks_[0] + x);
    if (refs_[index] < kFirstMixed) return of_brick(index);
    const Blocks& mixed = mixed_[refs_[index] - kFirstMixed];
    Range inside = blocks;
    const std::array<std::int64_t, 3> brick = {x, y, z};
    for (std::size_t i = 0; i < 3; ++i) {
      inside.begin[i] = std::max<std::int64_t>(blocks.begin[i], brick[i] * kBlocks);
      inside.end[i] = std::min<std::int64_t>(blocks.end[i], (brick[i] + 1) * kBlocks);
    }
    return inside.all_of(box_S, [&](std::int64_t bx, std::int64_t by, std::int64_t bz, const Vec3& middle) {
      const std::int64_t in_brick = ((bz - z * kBlocks) * kBlocks + by - y * kBlocks) * kBlocks + bx - x * kBlocks;
      return of_block(mixed[static_cast<std::size_t>(in_brick)], middle);
    });
  });
}

// Returns whether the largest distance to the planes is certainly not negative anywhere in an axis-aligned box. Its
// corners are not sufficient for this test, since a thin wall may pass between them. The result is true if one plane,
// or the mean of the distances to two planes, is not negative in the whole box.
bool PlaneMap::is_above_some(PlaneSet set, const Vec3& middle, const Vec3& half_m) const noexcept {
  for (PlaneSet rest = set; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = planes_[static_cast<std::size_t>(std::countr_zero(rest))];
    const double at_middle = plane.distance_m(middle);
    if (at_middle >= plane.normal.cwiseAbs().dot(half_m)) return true;
    for (PlaneSet others = rest & (rest - 1); others != 0; others &= others - 1) {
      const FieldPlane& other = planes_[static_cast<std::size_t>(std::countr_zero(others))];
      const Vec3 slope = plane.normal + other.normal;
      if (at_middle + other.distance_m(middle) >= slope.cwiseAbs().dot(half_m)) return true;
    }
  }
  return false;
}

// Returns whether a whole cube is deeper than any contact. The corners suffice for the test, because the largest
// distance to planes is a convex function.
bool PlaneMap::is_deep(PlaneSet set, const Vec3& middle, double edge_m) const noexcept {
  return for_corners(middle, edge_m / 2 * Eigen::Matrix3d::Identity(),
                     [&](const Vec3& p_S) { return largest_m(planes_, set, p_S) <= -kDeep_m; });
}

// Returns whether the planes may replace the field outside the lattice, too, if the box extends beyond it. There is no
// surface there, so the largest distance to the planes must not be negative anywhere.
bool PlaneMap::is_right_beyond(PlaneSet set, const OrientedBox& box_S) const noexcept {
  const Vec3 reach = box_S.axes.cwiseAbs() * box_S.half_m;
  for (int i = 0; i < 3; ++i) {
    const double low = box_S.centre[i] - reach[i], high = box_S.centre[i] + reach[i];
    const double from = origin_S_[i], to = from + bricks_[static_cast<std::size_t>(i)] * brick_m_;
    const auto is_right = [&](double begin, double end) {
      Vec3 middle = box_S.centre, half_m = reach;
      middle[i] = (begin + end) / 2;
      half_m[i] = (end - begin) / 2;
      return is_above_some(set, middle, half_m);
    };
    if (low < from && !is_right(low, std::min(high, from))) return false;
    if (high > to && !is_right(std::max(low, to), high)) return false;
  }
  return true;
}

// Returns whether the planes `others` may be ignored beside those of `set`: in the whole cube, some plane of `set` has
// at least their distance.
bool PlaneMap::is_below(PlaneSet others, PlaneSet set, const Vec3& middle, double edge_m) const noexcept {
  for (; others != 0; others &= others - 1) {
    const FieldPlane& other = planes_[static_cast<std::size_t>(std::countr_zero(others))];
    bool is_below = false;
    for (PlaneSet rest = set; rest != 0 && !is_below; rest &= rest - 1) {
      const FieldPlane& plane = planes_[static_cast<std::size_t>(std::countr_zero(rest))];
      const Vec3 slope = other.normal - plane.normal;
      const double at_middle = slope.dot(middle) + other.offset_m - plane.offset_m;
      is_below = at_middle + edge_m / 2 * slope.cwiseAbs().sum() <= kSameDistance_m;
    }
    if (!is_below) return false;
  }
  return true;
}

PlaneSet PlaneMap::planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept {
  if (planes_.empty() || !box_S.centre.allFinite()) return 0;
  PlaneSet all = 0;
  bool is_beyond_anywhere = false;
  std::size_t max_queries = queries + kMaxPlaneMapQueries;
  const auto add_planes_at = [&](std::uint8_t index) {
    if (++queries > max_queries || index == kNone) return false;
    is_beyond_anywhere = is_beyond_anywhere || index == kOutside || index == kInside;
    const PlaneSet before = std::exchange(all, all | sets_[index]);
    return all == before || std::popcount(all) <= kMaxInBox;
  };
  const Eigen::Matrix3d half_edges = box_S.axes * box_S.half_m.asDiagonal();
  // The corners of the box are checked first. This check rejects most boxes that extend beyond the flat parts or
  // contain a concave edge.
  std::array<std::uint8_t, 9> at_corners;
  std::size_t corners = 0;
  const auto add_corner = [&](const Vec3& p_S) { return add_planes_at(at_corners[corners++] = at(p_S)); };
  if (!add_corner(box_S.centre) || !for_corners(box_S.centre, half_edges, add_corner) || all == 0) return 0;
  corners = 1;
  const auto is_right_at = [&](const Vec3& p_S) { return is_largest_at(all, at_corners[corners++], p_S); };
  if (!is_largest_at(all, at_corners[0], box_S.centre) || !for_corners(box_S.centre, half_edges, is_right_at)) return 0;
  // The set of planes grows while blocks are read. In every block of the box, the largest distance to the whole set
  // must equal the field. A block outside of the shape may fail this test at first, because the plane above which it
  // lies is found later. It is tested again when the set no longer grows.
  bool is_below_outside = false;
  const auto is_right = [&](std::uint8_t index, const Vec3& middle, double edge_m) {
    if (is_largest(all, index, middle, edge_m)) return true;
    is_below_outside = true;
    return index == kOutside;
  };
  const auto add_brick = [&](std::size_t brick) {
    const auto index = static_cast<std::uint8_t>(refs_[brick]);
    if (!add_planes_at(index)) return false;
    if (index > kInside) return (all & ~sets_[index] & ~harmless_[brick]) == 0;
    if (index == kOutside && (all & harmless_[brick]) != 0) return true;
    return is_right(index, middle_of(brick), brick_m_);
  };
  const auto add_block = [&](std::uint8_t index, const Vec3& middle) {
    return add_planes_at(index) && is_right(index, middle, brick_m_ / kBlocks);
  };
  PlaneSet known = 0;
  while (all != known) {
    known = all;
    max_queries = queries + kMaxPlaneMapQueries;
    is_below_outside = false;
    if (!for_blocks(box_S, add_brick, add_block)) return 0;
  }
  if (is_below_outside) return 0;
  return (std::popcount(all) == 1 && !is_beyond_anywhere) || is_right_beyond(all, box_S) ? all : 0;
}

}  // namespace tandem::contact
