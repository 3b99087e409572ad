// Whether something passed through a surface, judged from the motion and the exact meshes alone.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

/// Follows points of the surface of one body relative to another.
///
/// Model   A point has popped through when it is more than `too_deep_m` inside, or more than `shallow_m` inside and
///         closest to a side that faces away from the one it came in by: so thin walls count too. Between steps the
///         points are taken to move straight, in pieces of at most 0.25 mm.
class PointsThrough {
 public:
  struct Bounds {
    double too_deep_m = 2e-3;
    double shallow_m = 5e-4;
  };
  /// In      points_M  in the frame of the moving body; outside of `other` at the first step
  PointsThrough(std::vector<Vec3> points_M, const ExactSurface& other, const Bounds& bounds);

  /// The moving body relative to the other; returns how many points are through now.
  std::size_t step(const Pose& X_OM);
  /// Of any point at any step.
  double deepest_m() const { return deepest_m_; }

 private:
  struct Follower {
    Vec3 p_M = Vec3::Zero();
    Vec3 last_O = Vec3::Zero();
    Vec3 entry_O = Vec3::Zero();  ///< normal of the side that it was last outside of
    bool is_inside = false;
    bool is_through = false;
  };
  void move(Follower& follower, const Vec3& p_O);

  const ExactSurface& other_;
  Bounds bounds_;
  std::vector<Follower> followers_;
  double deepest_m_ = 0;
  bool has_started_ = false;
};

/// Points of each of two bodies against the other; counts how often a pair goes from none through to some.
class PopThroughWatch {
 public:
  static constexpr std::size_t kPoints = 200;  ///< of each body

  PopThroughWatch(const ExactSurface& a, const ExactSurface& b, const PointsThrough::Bounds& bounds = {});
  void step(const Pose& X_WA, const Pose& X_WB);
  std::uint64_t count() const { return count_; }
  double deepest_m() const { return std::max(a_in_b_.deepest_m(), b_in_a_.deepest_m()); }

 private:
  PointsThrough a_in_b_;
  PointsThrough b_in_a_;
  std::uint64_t count_ = 0;
  bool is_through_ = false;
};

}  // namespace tandem::lab
