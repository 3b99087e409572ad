// The points of a leaf as the other shape's field sees them at one pose, and the candidates that they are.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/point_shell.hpp"

namespace tandem::contact {

/// A point of the shell, or several as one, or a node above planes of the field.
struct ShellCandidate {
  Eigen::Vector3f p_P = Eigen::Vector3f::Zero();
  float area_m2 = 0;
  double distance_m = 0;            ///< at this pose; not of nodes above planes
  Vec3 gradient_F = Vec3::UnitZ();  ///< likewise; about unit
  std::uint32_t first = 0;
  std::uint32_t count = 0;  ///< it stands for points first .. first + count − 1
  std::uint32_t node = 0;   ///< it is this one, if it has planes
  PlaneSet planes = 0;      ///< below the node; none for points
};

/// Of each point that a leaf is asked for, a distance in steps, rounded down; the last step is all beyond.
using LeafLags = std::array<std::uint8_t, kShellLeafPoints>;
inline constexpr double kLagStep_m = 8e-6;

/// What is sampled is steeper than a distance where a grid interpolates: each of its three slopes is about 1 at most.
inline constexpr double kSteepest = 1.75;
/// Room for rounding in a field.
inline constexpr double kRounding_m = 3e-8;

/// kShellLeafPoints points of a node (frame P) in a field (frame F): all of a leaf's, or some, each with its share of the
/// node's area.
class LeafSamples {
 public:
  /// In      lags, up_to_m  points that lag more than that are not asked: they are far
  ///         rigid_depth_m  of the contact, which a thin wall that the field hardly knows must reach, too
  LeafSamples(const PointShell& shell, const ShellNode& node, const DistanceField& field, const Eigen::Matrix3d& R_FP,
              const Vec3& p_FP, const LeafLags& lags, double up_to_m, double rigid_depth_m) noexcept;

  /// Brings near what one of such a node is going to read.
  static void prefetch(const PointShell& shell, const ShellNode& node) noexcept;

  std::size_t size() const { return size_; }
  std::uint32_t asked() const { return asked_; }
  double distance_m(std::size_t k) const { return samples_(static_cast<Eigen::Index>(k), 0); }
  /// When part and field have moved by that against each other, a point may be as near as the least band.
  ///
  /// In      gone_m    now
  ///         before_m  of the points that were not asked, as `lags` says
  /// Out     lags      of all points
  double asked_again(double gone_m, double least_band_m, double before_m, LeafLags& lags) const;
  /// Points of the node that are nearer, about.
  std::size_t near_count(double band_m) const;

  /// One by one; as one where all of them are near and as far as each other.
  void add_points(double band_m, std::vector<ShellCandidate>& candidates) const;
  /// What presses as one, with its force and moment, and what does not press yet. Where that would lose force, as around
  /// an edge, or where some are beyond `rigid_depth_m`, what presses stays points.
  ///
  /// In      must  as one nevertheless
  void add_joined(double band_m, double rigid_depth_m, bool must, std::vector<ShellCandidate>& candidates) const;

 private:
  /// Of the points from `low_m` to below `high_m` the mean, of their forces where they press. Area 0: there is none; its gradient is
  /// shorter than 1 where theirs differ.
  ShellCandidate mean_of(double low_m, double high_m) const;
  static std::uint32_t first_of(const ShellNode& node, std::size_t size, std::size_t k) {
    return node.first + static_cast<std::uint32_t>(size == node.count ? k : k * node.count / kShellLeafPoints);
  }
  std::uint32_t first_of(std::size_t k) const { return first_of(node_, size_, k); }
  ShellCandidate candidate_of(std::size_t k) const;
  double area_scale() const;
  void look_from_outside(const Eigen::Matrix3d& R_FP, const Vec3& p_FP, double rigid_depth_m) noexcept;

  const PointShell& shell_;
  const ShellNode& node_;
  const DistanceField& field_;
  std::size_t size_;
  std::uint32_t asked_ = 0;
  double area_scale_ = 1;  ///< the node's over that of these points
  double nearest_m_;
  double farthest_m_;
  EightSamples samples_;  ///< distance infinite: not asked
  bool is_held_ = false;  ///< some point, in a thin wall
};

}  // namespace tandem::contact
