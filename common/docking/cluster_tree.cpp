// See cluster_tree.hpp.
#include "common/docking/cluster_tree.hpp"

#include <algorithm>
#include <numeric>

#include "common/docking/field_kernel.hpp"

namespace tandem::docking {

ClusterTree::ClusterTree(std::span<const Vec3> points) : order_(points.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  if (!points.empty()) split(points, 0, points.size(), 1);
}

std::uint32_t ClusterTree::split(std::span<const Vec3> points, std::size_t begin, std::size_t end, std::size_t depth) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  depth_ = std::max(depth_, depth);
  Node node;
  node.first_leaf = static_cast<std::uint32_t>(begin / kLanes);
  Vec3 lower = points[order_[begin]], upper = lower;
  for (std::size_t i = begin; i < end; ++i) {
    lower = lower.cwiseMin(points[order_[i]]);
    upper = upper.cwiseMax(points[order_[i]]);
  }
  node.centre = 0.5 * (lower + upper);
  node.half = 0.5 * (upper - lower);
  node.radius = node.half.maxCoeff();
  if (end - begin > kLanes) {
    Eigen::Index axis = 0;
    node.half.maxCoeff(&axis);
    // Whole leaves on the left. Ties are broken by the index, so that every machine has the same clusters.
    const std::size_t leaves = (end - begin + kLanes - 1) / kLanes;
    const std::size_t middle = begin + leaves / 2 * kLanes;
    const auto comes_first = [&points, axis](std::uint32_t i, std::uint32_t j) {
      const double x = points[i][axis], y = points[j][axis];
      return x < y || (x == y && i < j);
    };
    std::sort(order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.begin() + static_cast<std::ptrdiff_t>(end),
              comes_first);
    node.children[0] = split(points, begin, middle, depth + 1);
    node.children[1] = split(points, middle, end, depth + 1);
  }
  nodes_[index] = node;
  return index;
}

NeighbourSearch::NeighbourSearch(const ClusterTree& a, const ClusterTree& b) : a_(a.nodes()), b_(b.nodes()) {
  arena_.resize((b.depth() + 2) * a.nodes().size());
}

void NeighbourSearch::collect(std::uint32_t node, const Vec3& centre, const Vec3& half, double radius,
                              std::size_t& near) noexcept {
  const ClusterTree::Node& a = a_[node];
  const Vec3 gap = ((centre - a.centre).cwiseAbs() - (half + a.half)).cwiseMax(0.0);
  if (gap.squaredNorm() > cutoff2_) return;
  if (a.is_leaf() || a.radius <= radius) {
    arena_[near++] = node;
    return;
  }
  for (const std::uint32_t child : a.children) collect(child, centre, half, radius, near);
}

}  // namespace tandem::docking
