#include "common/docking/cluster_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numbers>
#include <numeric>

namespace tandem::docking {
namespace {

/// Coordinate [Å] for the unused children of a node. It is beyond any cut-off, and its square is a finite float.
constexpr float kNowhere = 1e18F;
/// Sets with at most this number of atoms are not split further. The number is the width of the smallest vector
/// register. The atoms in a register are thus close together, so that fewer registers have atoms within the cut-off.
constexpr std::size_t kFewest = 4;
/// Candidate directions of a split: the three axes, followed by the diagonals. Diagonals are tried only for sets of at
/// most kMaxOblique points.
constexpr std::array<std::array<int, 3>, 13> kDirections{{{1, 0, 0},
                                                          {0, 1, 0},
                                                          {0, 0, 1},
                                                          {1, 1, 0},
                                                          {1, -1, 0},
                                                          {1, 0, 1},
                                                          {1, 0, -1},
                                                          {0, 1, 1},
                                                          {0, 1, -1},
                                                          {1, 1, 1},
                                                          {1, 1, -1},
                                                          {1, -1, 1},
                                                          {-1, 1, 1}}};
constexpr std::size_t kMaxOblique = 1024;
/// Factor that increases a half edge length, so that rounding to float does not make the box too small.
constexpr float kRoundedUp = 1 + 2 * std::numeric_limits<float>::epsilon();

/// Writes centre and half edge lengths, one float per axis with the given stride. The half edges are rounded up so that
/// the stored box contains `box`.
void store_box(const Eigen::AlignedBox3d& box, float* centre, float* half, std::size_t stride) {
  for (int axis = 0; axis < 3; ++axis, centre += stride, half += stride) {
    *centre = static_cast<float>(box.center()[axis]);
    const auto from = static_cast<double>(*centre);
    *half = kRoundedUp * static_cast<float>(std::max(box.max()[axis] - from, from - box.min()[axis]));
  }
}

/// Returns the approximate volume [Å³] of the region within 8 Å of the box. It measures the cost of the atoms in the
/// box, because only atoms of the other molecule in this region can form pairs with them.
double reach_of(const Eigen::AlignedBox3d& box) {
  constexpr double kReach = 8;
  const Vec3 side = box.sizes();
  return side.prod() + 2 * kReach * (side.x() * side.y() + side.y() * side.z() + side.z() * side.x()) +
         std::numbers::pi * kReach * kReach * side.sum();
}

std::vector<Eigen::AlignedBox3d> grouped(std::span<const Eigen::AlignedBox3d> parts, std::size_t size) {
  std::vector<Eigen::AlignedBox3d> groups((parts.size() + size - 1) / size);
  for (std::size_t i = 0; i < parts.size(); ++i) groups[i / size].extend(parts[i]);
  return groups;
}

std::vector<ChildBoxes> nodes_over(std::span<const Eigen::AlignedBox3d> children) {
  ChildBoxes empty = {};
  for (float(&axis)[kChildren] : empty.centre) std::ranges::fill(axis, kNowhere);
  std::vector<ChildBoxes> nodes((children.size() + kChildren - 1) / kChildren, empty);
  for (std::size_t i = 0; i < children.size(); ++i) {
    ChildBoxes& node = nodes[i / kChildren];
    store_box(children[i], &node.centre[0][i % kChildren], &node.half[0][i % kChildren], kChildren);
  }
  return nodes;
}

}  // namespace

Eigen::AlignedBox3d child_box(const ChildBoxes& boxes, std::size_t child) noexcept {
  Vec3 centre, half;
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] = static_cast<double>(boxes.centre[axis][child]);
    half[axis] = static_cast<double>(boxes.half[axis][child]);
  }
  return {Vec3(centre - half), Vec3(centre + half)};
}

ClusterTree::ClusterTree(std::span<const Vec3> points) : order_(points.size()) {
  if (points.empty()) return;
  std::iota(order_.begin(), order_.end(), 0U);
  split(points, 0, points.size());
  std::vector<Eigen::AlignedBox3d> bounds;
  for (const std::uint32_t index : order_) bounds.emplace_back(points[index]);
  bounds = grouped(bounds, kLanes);
  leaf_count_ = bounds.size();
  do {
    levels_.push_back(nodes_over(bounds));
    bounds = grouped(bounds, kChildren);
  } while (bounds.size() > 1);
  box_ = bounds.front();
}

// Reorders the points [begin, end) such that those before `middle` are lower along the direction `along` than the
// others. If two points are equally far along it, their indices decide, so that every machine builds the same clusters.
void ClusterTree::halve(std::span<const Vec3> points, const Vec3& along, std::size_t begin, std::size_t middle,
                        std::size_t end) {
  const auto comes_first = [&points, &along](std::uint32_t i, std::uint32_t j) {
    const double x = along.dot(points[i]), y = along.dot(points[j]);
    return x < y || (x == y && i < j);
  };
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), comes_first);
}

Eigen::AlignedBox3d ClusterTree::box_of(std::span<const Vec3> points, std::size_t begin, std::size_t end) const {
  Eigen::AlignedBox3d box;
  for (std::size_t i = begin; i < end; ++i) box.extend(points[order_[i]]);
  return box;
}

void ClusterTree::split(std::span<const Vec3> points, std::size_t begin, std::size_t end) {
  const std::size_t count = end - begin;
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  if (count <= kFewest) return std::sort(at(begin), at(end));
  std::size_t child = count <= kLanes ? std::bit_ceil(count) / 2 : kLanes;
  while (child * kChildren < count) child *= kChildren;
  // Divides the set into two parts; the first part consists of full children only. The chosen direction minimises the
  // sum of reach_of() over both parts.
  const std::size_t children = (count + child - 1) / child;
  const std::size_t middle = begin + children / 2 * child;
  double least = std::numeric_limits<double>::infinity();
  Vec3 best = Vec3::UnitX();
  const std::size_t directions = count <= kMaxOblique ? kDirections.size() : 3;
  for (std::size_t d = 0; d < directions; ++d) {
    const Vec3 along(kDirections[d][0], kDirections[d][1], kDirections[d][2]);
    halve(points, along, begin, middle, end);
    const double reached = reach_of(box_of(points, begin, middle)) + reach_of(box_of(points, middle, end));
    if (reached < least) best = along;
    least = std::min(least, reached);
  }
  halve(points, best, begin, middle, end);
  split(points, begin, middle);
  split(points, middle, end);
}

NeighbourSearch::NeighbourSearch(const ClusterTree& a, const ClusterTree& b, NearChildren near_children)
    : a_(a), b_(b), near_children_(near_children) {
  for (std::size_t level = 0; level < a.levels().size(); ++level) {
    arena_.emplace_back(a.child_count(level) + kChildren);
  }
}

void NeighbourSearch::place_b(const Pose& X_AB, double cutoff) noexcept {
  R_AB_ = X_AB.q.toRotationMatrix();
  abs_R_AB_ = R_AB_.cwiseAbs();
  p_AB_ = X_AB.p;
  reach2_ = static_cast<float>(static_cast<double>(kReachMargin) * cutoff * cutoff);
}

std::span<const std::uint32_t> NeighbourSearch::near(std::size_t level, std::span<const std::uint32_t> nodes,
                                                     const Eigen::AlignedBox3d& box) noexcept {
  float centre[3], half[3];
  store_box(box, centre, half, 1);
  std::uint32_t* const found = arena_[level].data();
  const ChildBoxes* const boxes = a_.levels()[level].data();
  return {found, near_children_(boxes, nodes.data(), nodes.size(), centre, half, reach2_, found)};
}

Eigen::AlignedBox3d NeighbourSearch::placed(const Eigen::AlignedBox3d& box) const noexcept {
  const Vec3 centre = p_AB_ + R_AB_ * box.center();
  const Vec3 half = 0.5 * (abs_R_AB_ * box.sizes());
  return {Vec3(centre - half), Vec3(centre + half)};
}

}  // namespace tandem::docking
