#include "lab/studies/contact/pop_through.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tandem::lab {
namespace {

constexpr double kPiece_m = 2.5e-4;
constexpr int kMaxPieces = 1000;

/// Points of one body's surface, followed relative to another body.
class PointsThrough {
 public:
  /// In      points_M  in the frame of the moving body
  PointsThrough(const std::vector<Vec3>& points_M, const ExactSurface& other, double too_deep_m, double shallow_m)
      : other_(other), too_deep_m_(too_deep_m), shallow_m_(shallow_m) {
    for (const Vec3& p_M : points_M) followers_.push_back({.p_M = p_M});
  }

  /// The moving body relative to the other; returns how many points are through now.
  std::size_t step(const Pose& X_OM);
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
  double too_deep_m_;
  double shallow_m_;
  std::vector<Follower> followers_;
  double deepest_m_ = 0;
  bool has_started_ = false;
};

std::size_t PointsThrough::step(const Pose& X_OM) {
  std::size_t through = 0;
  for (Follower& follower : followers_) {
    const Vec3 p_O = X_OM * follower.p_M;
    if (!has_started_) follower.last_O = p_O;
    const Vec3 from_O = follower.last_O;
    const double length = (p_O - from_O).norm();
    const int pieces = std::clamp(static_cast<int>(std::ceil(length / kPiece_m)), 1, kMaxPieces);
    // The ball around the stretch: far from the box, nothing on it matters.
    if (follower.is_inside || other_.may_touch((from_O + p_O) / 2, length / 2 + too_deep_m_)) {
      for (int i = 1; i <= pieces; ++i) move(follower, from_O + (p_O - from_O) * i / pieces);
    }
    follower.last_O = p_O;
    through += follower.is_through ? 1 : 0;
  }
  has_started_ = true;
  return through;
}

void PointsThrough::move(Follower& follower, const Vec3& p_O) {
  const geometry::TriangleTree::Closest closest = other_.tree().closest(p_O, too_deep_m_);
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
  if (closest.distance_m > shallow_m_ && normal.dot(follower.entry_O) < 0) follower.is_through = true;
}

}  // namespace

struct PopThroughWatch::Impl {
  PointsThrough a_in_b;
  PointsThrough b_in_a;
  std::uint64_t count = 0;
  bool is_through = false;
};

PopThroughWatch::PopThroughWatch(const ExactSurface& a, const ExactSurface& b, double too_deep_m, double shallow_m)
    : impl_(new Impl{PointsThrough(a.samples(kPoints, 1), b, too_deep_m, shallow_m),
                     PointsThrough(b.samples(kPoints, 2), a, too_deep_m, shallow_m)}) {}

PopThroughWatch::~PopThroughWatch() = default;

void PopThroughWatch::step(const Pose& X_WA, const Pose& X_WB) {
  const std::size_t through = impl_->a_in_b.step(X_WB.inverse() * X_WA) + impl_->b_in_a.step(X_WA.inverse() * X_WB);
  if (through > 0 && !impl_->is_through) ++impl_->count;
  impl_->is_through = through > 0;
}

std::uint64_t PopThroughWatch::count() const {
  return impl_->count;
}

double PopThroughWatch::deepest_m() const {
  return std::max(impl_->a_in_b.deepest_m(), impl_->b_in_a.deepest_m());
}

}  // namespace tandem::lab
