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

/// Lag of each point of a leaf: additional motion, beyond the bound of the leaf, after which this point must be sampled
/// again. The unit is kLagStep_m; lags are rounded down. The largest value also stands for all larger lags.
using LeafLags = std::array<std::uint8_t, kShellLeafPoints>;
inline constexpr double kLagStep_m = 8e-6;

/// Lipschitz constant of an interpolated grid: bound of its slope. Each of the three partial derivatives is at most
/// about 1, so the gradient may be about √3 long. For an exact distance, the bound would be 1.
inline constexpr double kSteepest = 1.75;
/// Tolerance for rounding errors in a field's distances.
inline constexpr double kRounding_m = 3e-8;

/// Samples up to kShellLeafPoints points of a node (frame P) in a field (frame F). In a leaf, these are all points. In
/// a larger node, they are some of the points and represent the area of the whole node.
class LeafSamples {
 public:
  /// In      lags, up_to_m  points whose lag exceeds up_to_m are certainly far and are not sampled
  ///         rigid_depth_m  depth beyond which contact is rigid; in a thin wall, a corrected depth is at most 1.2 times
  ///         this
  LeafSamples(const PointShell& shell, const ShellNode& node, const DistanceField& field, const Eigen::Matrix3d& R_FP,
              const Vec3& p_FP, const LeafLags& lags, double up_to_m, double rigid_depth_m) noexcept;

  /// Prefetches the memory that sampling this node reads.
  static void prefetch(const PointShell& shell, const ShellNode& node) noexcept;

  std::size_t size() const { return size_; }
  std::uint32_t queries() const { return queries_; }
  double distance_m(std::size_t k) const { return samples_(static_cast<Eigen::Index>(k), 0); }
  /// Returns the bound of the leaf: the accumulated motion at which one of its points may become nearer than
  /// `least_band_m`, the narrowest band so far.
  ///
  /// In      moved_m   accumulated motion now
  ///         before_m  value of the previous bound, to which `lags` are relative; for points that were not sampled in
  ///         this step
  /// Out     lags      lag of each point, relative to the result
  double query_again_at_m(double moved_m, double least_band_m, double before_m, LeafLags& lags) const;
  /// Returns the estimated number of points of the node that are nearer than the band.
  std::size_t near_count(double band_m) const;

  /// Adds each near point as a candidate. If all points are near, equally deep and have the same gradient, one
  /// candidate represents them all.
  void add_points(double band_m, std::vector<ShellCandidate>& candidates) const;
  /// Adds one candidate for all pressing points (inside the other shape), with their force and moment, and a second one
  /// for the other near points. In three cases merging would lose force, and each point becomes a candidate: around an
  /// edge, in a thin wall, or if only some of the pressing points are deeper than `rigid_depth_m`.
  ///
  /// In      must  true: pressing points are merged in these three cases, too
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
