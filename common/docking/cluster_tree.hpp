// Clusters of neighbouring atoms, and the search for pairs of clusters of two molecules within a cut-off.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/field_kernel.hpp"

namespace tandem::docking {

/// Returns the box of one child [Å].
Eigen::AlignedBox3d child_box(const ChildBoxes& boxes, std::size_t child) noexcept;

/// Bounding-volume tree over points. Each leaf has kLanes atoms, and each node has kChildren children; only the last
/// leaf, and the last node of each level, may have fewer. Child l of node n in a level therefore has the index
/// kChildren · n + l among all children of this level.
/// The splits keep each part compact, so that few atoms of the other molecule are close to it. The atoms within a leaf
/// are split in the same way, down to the registers of a kernel.
class ClusterTree {
 public:
  /// Cost    one second for 200,000 points
  explicit ClusterTree(std::span<const Vec3> points);

  /// Boxes of the children of each node, by level. In level 0 the children are leaves; the last level has one node, the
  /// root. Empty if there are no points.
  const std::vector<std::vector<ChildBoxes>>& levels() const { return levels_; }
  /// Returns the total number of children of the nodes of a level.
  std::size_t child_count(std::size_t level) const { return level == 0 ? leaf_count_ : levels_[level - 1].size(); }
  const Eigen::AlignedBox3d& box() const { return box_; }             ///< box that contains all points
  const std::vector<std::uint32_t>& order() const { return order_; }  ///< indices of the input points, leaf by leaf

 private:
  void halve(std::span<const Vec3> points, const Vec3& along, std::size_t begin, std::size_t middle, std::size_t end);
  Eigen::AlignedBox3d box_of(std::span<const Vec3> points, std::size_t begin, std::size_t end) const;
  void split(std::span<const Vec3> points, std::size_t begin, std::size_t end);

  std::vector<std::vector<ChildBoxes>> levels_;
  Eigen::AlignedBox3d box_;
  std::vector<std::uint32_t> order_;
  std::size_t leaf_count_ = 0;
};

/// Finds the leaves of A that are close to each leaf of B. It keeps no state between calls: the result depends only on
/// the pose.
class NeighbourSearch {
 public:
  /// In      near_children  a kernel whose instruction set the CPU supports
  NeighbourSearch(const ClusterTree& a, const ClusterTree& b, NearChildren near_children);

  /// Calls found(leaf of B, close leaves of A) for each leaf of B that has close leaves of A. Both are in ascending
  /// order. Two leaves are close if the distance of their bounding boxes is within the cut-off.
  /// Cost    proportional to the nodes near the interface; no allocation
  template <class Found>
  void run(const Pose& X_AB, double cutoff, const Found& found) {
    if (a_.levels().empty() || b_.levels().empty()) return;
    place_b(X_AB, cutoff);
    const Eigen::AlignedBox3d whole = placed(b_.box());
    std::size_t level = a_.levels().size();
    std::span<const std::uint32_t> candidates(&kRoot, 1);
    while (level > b_.levels().size()) candidates = near(--level, candidates, whole);
    visit(b_.levels().size() - 1, kRoot, candidates, found);
  }

 private:
  static constexpr std::uint32_t kRoot = 0;

  void place_b(const Pose& X_AB, double cutoff) noexcept;
  /// Returns a box along A's axes that contains `box`, which is given along B's axes.
  Eigen::AlignedBox3d placed(const Eigen::AlignedBox3d& box) const noexcept;
  /// Returns the children of the given nodes of A whose boxes are within the cut-off of `box`.
  std::span<const std::uint32_t> near(std::size_t level, std::span<const std::uint32_t> nodes,
                                      const Eigen::AlignedBox3d& box) noexcept;

  /// Searches for close leaves below node `node` of B in level `level`. `candidates` are the nodes of A in the same
  /// level that are close to this node of B. If A's tree has fewer levels, the root of A is the only candidate.
  template <class Found>
  void visit(std::size_t level, std::uint32_t node, std::span<const std::uint32_t> candidates, const Found& found) {
    const bool is_above_a = level >= a_.levels().size();
    const std::size_t count = b_.child_count(level);
    for (std::size_t l = 0; l < kChildren && kChildren * node + l < count; ++l) {
      const auto child = static_cast<std::uint32_t>(kChildren * node + l);
      const Eigen::AlignedBox3d box = placed(child_box(b_.levels()[level][node], l));
      const auto nearby = near(is_above_a ? a_.levels().size() - 1 : level, candidates, box);
      if (nearby.empty()) continue;
      if (level == 0) {
        found(child, nearby);
      } else {
        visit(level - 1, child, is_above_a ? candidates : nearby, found);
      }
    }
  }

  const ClusterTree& a_;
  const ClusterTree& b_;
  NearChildren near_children_;
  std::vector<std::vector<std::uint32_t>> arena_;  ///< indices of the close children, for each level of A
  Eigen::Matrix3d R_AB_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d abs_R_AB_ = Eigen::Matrix3d::Identity();
  Vec3 p_AB_ = Vec3::Zero();
  float reach2_ = 0;
};

}  // namespace tandem::docking
