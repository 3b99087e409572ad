// Samples the points of a leaf in the other shape's field at one pose, and makes candidates from them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

/// For each point of a leaf: additional motion, beyond the leaf's bound, after which the point must be sampled again.
/// The unit is kLagStep_m; lags are rounded down. The largest value stands for all larger lags.
using LeafLags = std::array<std::uint8_t, kShellLeafPoints>;
inline constexpr double kLagStep_m = 8e-6;

/// Lipschitz bound of an interpolated grid. Each of its three partial derivatives is at most about 1, so its gradient
/// may be up to about √3 long. The gradient of an exact distance has length 1.
inline constexpr double kSteepest = 1.75;
/// Tolerance for rounding errors in a field's distances.
inline constexpr double kRounding_m = 3e-8;

/// Samples up to kShellLeafPoints points of a node (frame P) in a field (frame F). In a leaf, these are all points. In
/// a larger node, they are some of the points and represent the area of the whole node.
class LeafSamples {
 public:
  /// In      lags, up_to_m  a point whose lag exceeds up_to_m is still far and is not sampled
  ///         rigid_depth_m  depth beyond which contact is rigid; the corrected depth in a thin wall may reach it
  LeafSamples(const PointShell& shell, const ShellNode& node, const DistanceField& field, const Eigen::Matrix3d& R_FP,
              const Vec3& p_FP, const LeafLags& lags, double up_to_m, double rigid_depth_m) noexcept;

  /// Prefetches the memory that sampling this node reads.
  static void prefetch(const PointShell& shell, const ShellNode& node) noexcept;

  std::size_t size() const { return size_; }
  std::uint32_t queries() const { return queries_; }
  double distance_m(std::size_t k) const { return samples_(static_cast<Eigen::Index>(k), 0); }
  /// Returns the accumulated motion from which some point of the leaf may be within the least band.
  ///
  /// In      moved_m   accumulated motion now
  ///         before_m  distance bound of the points that were not sampled, to which `lags` are relative
  /// Out     lags      lag of each point, relative to the result
  double query_again_at_m(double moved_m, double least_band_m, double before_m, LeafLags& lags) const;
  /// Returns the estimated number of points of the node that are nearer than the band.
  std::size_t near_count(double band_m) const;

  /// Adds each near point as a candidate. If all points are near, equally deep and have the same gradient, one
  /// candidate represents them all.
  void add_points(double band_m, std::vector<ShellCandidate>& candidates) const;
  /// Adds one candidate for all pressing points, with their force and moment. Adds a second one for the near points
  /// that do not press. Pressing points are not merged where force would be lost: around an edge, or where only some of
  /// them are deeper than `rigid_depth_m`.
  ///
  /// In      must  true: points are merged even where force is lost
  void add_joined(double band_m, double rigid_depth_m, bool must, std::vector<ShellCandidate>& candidates) const;

 private:
  /// Returns the mean of the points with distances in [low_m, high_m). Pressing points are weighted by their forces,
  /// others by their areas. The area is 0 if there is no such point. If gradients differ, the mean gradient is shorter
  /// than 1.
  ShellCandidate mean_of(double low_m, double high_m) const;
  static std::uint32_t first_of(const ShellNode& node, std::size_t size, std::size_t k) {
    return node.first + static_cast<std::uint32_t>(size == node.count ? k : k * node.count / kShellLeafPoints);
  }
  std::uint32_t first_of(std::size_t k) const { return first_of(node_, size_, k); }
  ShellCandidate candidate_of(std::size_t k) const;
  double area_scale() const;
  void sample_from_outside(const Eigen::Matrix3d& R_FP, const Vec3& p_FP, double rigid_depth_m) noexcept;

  const PointShell& shell_;
  const ShellNode& node_;
  const DistanceField& field_;
  std::size_t size_;
  std::uint32_t queries_ = 0;
  double area_scale_ = 1;  ///< ratio of the node's area to the area of the sampled points
  double nearest_m_;
  double farthest_m_;
  EightSamples samples_;  ///< an infinite distance marks a point that was not sampled
  bool is_held_ = false;  ///< true: sample_from_outside() corrected a point in a thin wall
};

}  // namespace tandem::contact
