#include "lab/studies/contact/pop_through.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tandem::lab {
namespace {

constexpr double kPiece_m = 2.5e-4;
constexpr int kMaxPieces = 1000;

}  // namespace

PointsThrough::PointsThrough(std::vector<Vec3> points_M, const ExactSurface& other, const Bounds& bounds)
    : other_(other), bounds_(bounds) {
  for (const Vec3& p_M : points_M) followers_.push_back({.p_M = p_M});
}

std::size_t PointsThrough::step(const Pose& X_OM) {
  std::size_t through = 0;
  for (Follower& follower : followers_) {
    const Vec3 p_O = X_OM * follower.p_M;
    if (!has_started_) follower.last_O = p_O;
    const Vec3 from_O = follower.last_O;
    const double length = (p_O - from_O).norm();
    const int pieces = std::clamp(static_cast<int>(std::ceil(length / kPiece_m)), 1, kMaxPieces);
    // The ball around the stretch: far from the box, nothing on it matters.
    if (follower.is_inside || other_.may_touch((from_O + p_O) / 2, length / 2 + bounds_.too_deep_m)) {
      for (int i = 1; i <= pieces; ++i) move(follower, from_O + (p_O - from_O) * i / pieces);
    }
    follower.last_O = p_O;
    through += follower.is_through ? 1 : 0;
  }
  has_started_ = true;
  return through;
}

void PointsThrough::move(Follower& follower, const Vec3& p_O) {
  const geometry::TriangleTree::Closest closest = other_.tree().closest(p_O, bounds_.too_deep_m);
  if (closest.triangle < 0) {
    // Farther from the surface than a point may be inside.
    if (follower.is_inside) {
      follower.is_through = true;
      deepest_m_ = std::max(deepest_m_, -other_.distance_m(p_O, std::numeric_limits<double>::infinity()));
    }
    return;
  }
  const Vec3 normal = closest.normal_S.stableNormalized();
  follower.is_inside = (p_O - closest.point_S).dot(normal) < 0;
  if (!follower.is_inside) {
    follower.entry_O = normal;
    follower.is_through = false;
    return;
  }
  deepest_m_ = std::max(deepest_m_, closest.distance_m);
  if (closest.distance_m > bounds_.shallow_m && normal.dot(follower.entry_O) < 0) follower.is_through = true;
}

PopThroughWatch::PopThroughWatch(const ExactSurface& a, const ExactSurface& b, const PointsThrough::Bounds& bounds)
    : a_in_b_(a.samples(kPoints, 1), b, bounds), b_in_a_(b.samples(kPoints, 2), a, bounds) {}

void PopThroughWatch::step(const Pose& X_WA, const Pose& X_WB) {
  const std::size_t through = a_in_b_.step(X_WB.inverse() * X_WA) + b_in_a_.step(X_WA.inverse() * X_WB);
  if (through > 0 && !is_through_) ++count_;
  is_through_ = through > 0;
}

}  // namespace tandem::lab
