// Atoms in clusters of neighbours, and which clusters of two molecules are near each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// A binary tree over leaves of kLanes atoms each (the last may have fewer), split across the longest side.
class ClusterTree {
 public:
  struct Node {
    Vec3 centre = Vec3::Zero();      ///< of the box that holds all points
    Vec3 half = Vec3::Zero();        ///< of its sides
    double radius = 0;               ///< half of the longest side
    std::uint32_t first_leaf = 0;    ///< atoms order()[kLanes · first_leaf …]
    std::uint32_t children[2] = {};  ///< indices; zeros: a leaf

    bool is_leaf() const { return children[0] == 0; }
  };

  explicit ClusterTree(std::span<const Vec3> points);

  const std::vector<Node>& nodes() const { return nodes_; }           ///< the first is the root; none without points
  const std::vector<std::uint32_t>& order() const { return order_; }  ///< index of each point, leaf by leaf
  std::size_t depth() const { return depth_; }

 private:
  std::uint32_t split(std::span<const Vec3> points, std::size_t begin, std::size_t end, std::size_t depth);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  std::size_t depth_ = 0;
};

/// Finds the leaves of A near each leaf of B. Stateless between calls: the answer depends on the pose alone.
class NeighbourSearch {
 public:
  NeighbourSearch(const ClusterTree& a, const ClusterTree& b);

  /// Calls found(leaf of B, leaves of A of which the box is within the cut-off of its box) for each leaf of B that has
  /// any, in order.
  /// Cost    the nodes near the border; no allocation
  template <class Found>
  void run(const Pose& X_AB, double cutoff, const Found& found) {
    if (a_.empty() || b_.empty()) return;
    R_AB_ = X_AB.q.toRotationMatrix();
    p_AB_ = X_AB.p;
    cutoff2_ = cutoff * cutoff;
    arena_[0] = 0;
    visit(0, std::span<const std::uint32_t>(arena_.data(), 1), 1, found);
  }

 private:
  /// Appends to `near` what of A's node is within the cut-off of a box: nodes not larger than `radius`, or leaves.
  void collect(std::uint32_t node, const Vec3& centre, const Vec3& half, double radius, std::size_t& near) noexcept;

  template <class Found>
  void visit(std::uint32_t node_b, std::span<const std::uint32_t> candidates, std::size_t level, const Found& found) {
    const ClusterTree::Node& b = b_[node_b];
    const Vec3 centre = p_AB_ + R_AB_ * b.centre;
    const Vec3 half = R_AB_.cwiseAbs() * b.half;  // of a box along A's axes around B's
    const double radius = b.is_leaf() ? 0 : b.radius;
    const std::size_t begin = level * a_.size();
    std::size_t end = begin;
    for (const std::uint32_t candidate : candidates) collect(candidate, centre, half, radius, end);
    const std::span<const std::uint32_t> near(arena_.data() + begin, end - begin);
    if (near.empty()) return;
    if (b.is_leaf()) {
      for (std::size_t i = begin; i < end; ++i) arena_[i] = a_[arena_[i]].first_leaf;
      return found(b.first_leaf, near);
    }
    for (const std::uint32_t child : b.children) visit(child, near, level + 1, found);
  }

  const std::vector<ClusterTree::Node>& a_;
  const std::vector<ClusterTree::Node>& b_;
  std::vector<std::uint32_t> arena_;  ///< candidate nodes of each level of B's tree
  Eigen::Matrix3d R_AB_ = Eigen::Matrix3d::Identity();
  Vec3 p_AB_ = Vec3::Zero();
  double cutoff2_ = 0;
};

}  // namespace tandem::docking
