// See cluster_tree.hpp.
#include "common/docking/cluster_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>

namespace tandem::docking {
namespace {

/// What fills a node that is not full: farther than any cut-off, and its square is finite.
constexpr float kNowhere = 1e18F;
/// Above what a number loses when it is rounded to a float.
constexpr float kRoundedUp = 1 + 2 * std::numeric_limits<float>::epsilon();

/// Centre and half of the sides, one axis so far from the other, rounded so that they hold the box.
void put(const Eigen::AlignedBox3d& box, float* centre, float* half, std::size_t stride) {
  for (int axis = 0; axis < 3; ++axis, centre += stride, half += stride) {
    *centre = static_cast<float>(box.center()[axis]);
    const auto from = static_cast<double>(*centre);
    *half = kRoundedUp * static_cast<float>(std::max(box.max()[axis] - from, from - box.min()[axis]));
  }
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
    put(children[i], &node.centre[0][i % kChildren], &node.half[0][i % kChildren], kChildren);
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

void ClusterTree::split(std::span<const Vec3> points, std::size_t begin, std::size_t end) {
  const std::size_t count = end - begin;
  if (count <= kLanes) return;
  std::size_t child = kLanes;
  while (child * kChildren < count) child *= kChildren;
  Eigen::AlignedBox3d bounds;
  for (std::size_t i = begin; i < end; ++i) bounds.extend(points[order_[i]]);
  // Full children on the left. Ties are broken by the index, so that every machine has the same clusters.
  const std::size_t children = (count + child - 1) / child;
  const std::size_t middle = begin + children / 2 * child;
  Eigen::Index longest = 0;
  bounds.sizes().maxCoeff(&longest);
  const auto comes_first = [&points, axis = longest](std::uint32_t i, std::uint32_t j) {
    const double x = points[i][axis], y = points[j][axis];
    return x < y || (x == y && i < j);
  };
  std::sort(order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.begin() + static_cast<std::ptrdiff_t>(end),
            comes_first);
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
  put(box, centre, half, 1);
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
