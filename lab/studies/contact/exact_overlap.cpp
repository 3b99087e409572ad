#include "lab/studies/contact/exact_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/random.hpp"

namespace tandem::lab {
namespace {

std::vector<std::pair<int, int>> unique_edges(const geometry::TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      edges.emplace_back(std::min(from, to), std::max(from, to));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

/// Collects the vertices and edge samples of one mesh that lie inside the other mesh. Points with a depth below
/// `shallowest_m` are omitted. A search for only the deepest point raises this limit while it runs.
class Collector {
 public:
  Collector(const ExactSurface& other, double shallowest_m, double deepest_m)
      : other_(other), shallowest_m_(shallowest_m), deepest_m_(deepest_m) {}
  virtual ~Collector() = default;

  /// Collects from all parts of `from`. X_OF is the pose of `from` in the frame of the other mesh.
  void collect(const ExactSurface& from, const Pose& X_OF) {
    for (const ExactSurface* part : from.parts()) {
      from_half_m_ = part->half_thickness_m();
      for (const Vec3& corner : part->corners()) corner_at(X_OF * corner);
      for (const auto& [begin, end] : part->edges()) edge_between(X_OF * begin, X_OF * end);
    }
  }

 protected:
  virtual void found(const Vec3& p_O, double depth_m) = 0;
  void raise_shallowest(double depth_m) { shallowest_m_ = std::max(shallowest_m_, depth_m); }

 private:
  /// Returns the signed distance of `p_O` to the other body. It is infinite if the point is more than `near_m` outside
  /// the body, or inside it at more than the search depth.
  double distance_m(const Vec3& p_O, double near_m) const {
    if (!other_.may_touch(p_O, near_m + from_half_m_)) return std::numeric_limits<double>::infinity();
    return other_.distance_m(p_O, near_m + from_half_m_ + deepest_m_) - from_half_m_;
  }
  void corner_at(const Vec3& p_O) {
    const double distance = distance_m(p_O, 0);
    if (distance < -shallowest_m_) found(p_O, -distance);
  }
  void edge_between(const Vec3& begin_O, const Vec3& end_O) {
    const Vec3 middle = (begin_O + end_O) / 2;
    const double half_m = (end_O - begin_O).norm() / 2;
    const double distance = distance_m(middle, half_m);
    // The distance function is 1-Lipschitz: the depth at any point of this piece of the edge is at most the depth at
    // its midpoint plus half of the piece's length.
    if (half_m - distance <= shallowest_m_) return;
    if (2 * half_m <= kOverlapEdgeStep_m) {
      if (distance < -shallowest_m_) found(middle, -distance);
      return;
    }
    edge_between(begin_O, middle);
    edge_between(middle, end_O);
  }

  const ExactSurface& other_;
  double shallowest_m_;
  double deepest_m_;
  double from_half_m_ = 0;
};

class AllPoints final : public Collector {
 public:
  AllPoints(const ExactSurface& other, const Pose& X_WO, double shallowest_m, double deepest_m,
            std::vector<OverlapPoint>& out)
      : Collector(other, shallowest_m, deepest_m), X_WO_(X_WO), out_(out) {}

 private:
  void found(const Vec3& p_O, double depth_m) override { out_.push_back({X_WO_ * p_O, depth_m}); }

  Pose X_WO_;
  std::vector<OverlapPoint>& out_;
};

class Deepest final : public Collector {
 public:
  using Collector::Collector;
  double depth_m = 0;

 private:
  void found(const Vec3&, double depth_found_m) override {
    depth_m = std::max(depth_m, depth_found_m);
    raise_shallowest(depth_found_m);
  }
};

}  // namespace

ExactSurface::ExactSurface(const geometry::TriangleMesh& mesh, double half_thickness_m,
                           std::shared_ptr<const ExactSurface> beside, const geometry::TriangleMesh& inner)
    : mesh_(mesh),
      half_thickness_m_(half_thickness_m),
      tree_(half_thickness_m > 0 ? geometry::TriangleTree(mesh) : geometry::TriangleTree::of_solid(mesh, inner)),
      bounds_(bounds_of(mesh)),
      beside_(std::move(beside)) {
  std::vector<bool> is_used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles) {
    for (const int index : triangle) is_used[static_cast<std::size_t>(index)] = true;
  }
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (is_used[i]) corners_.push_back(mesh.vertices[i]);
  }
  for (const auto& [from, to] : unique_edges(mesh)) {
    edges_.push_back({mesh.vertices[static_cast<std::size_t>(from)], mesh.vertices[static_cast<std::size_t>(to)]});
  }
}

std::vector<const ExactSurface*> ExactSurface::parts() const {
  std::vector<const ExactSurface*> parts;
  for (const ExactSurface* part = this; part != nullptr; part = part->beside_.get()) parts.push_back(part);
  return parts;
}

bool ExactSurface::may_touch(const Vec3& p_S, double radius_m) const {
  const Vec3 outside = (bounds_.min() - p_S).cwiseMax(p_S - bounds_.max()).cwiseMax(0.0);
  const double reach_m = radius_m + half_thickness_m_;
  return outside.squaredNorm() <= reach_m * reach_m || (beside_ != nullptr && beside_->may_touch(p_S, radius_m));
}

geometry::TriangleTree::Closest ExactSurface::closest(const Vec3& p_S, double limit_m) const {
  geometry::TriangleTree::Closest closest = tree_.closest_of_solid(p_S, limit_m);
  if (closest.triangle < 0) return closest;
  const Vec3 off = p_S - closest.point_S;
  if (half_thickness_m_ <= 0) {
    closest.normal_S.normalize();
    if (off.dot(closest.normal_S) < 0) closest.distance_m = -closest.distance_m;
  } else if (closest.distance_m > 0) {
    closest.normal_S = off / closest.distance_m;
  }
  return closest;
}

double ExactSurface::distance_m(const Vec3& p_S, double limit_m) const {
  const geometry::TriangleTree::Closest nearest = closest(p_S, limit_m + half_thickness_m_);
  const double own_m =
      nearest.triangle < 0 ? std::numeric_limits<double>::infinity() : nearest.distance_m - half_thickness_m_;
  return beside_ == nullptr ? own_m : std::min(own_m, beside_->distance_m(p_S, limit_m));
}

std::vector<Vec3> ExactSurface::samples(std::size_t count, std::uint64_t seed) const {
  std::vector<double> area_up_to;
  double area = 0;
  const auto corner = [this](int index) { return mesh_.vertices[static_cast<std::size_t>(index)]; };
  for (const auto& [a, b, c] : mesh_.triangles) {
    area += (corner(b) - corner(a)).cross(corner(c) - corner(a)).norm();
    area_up_to.push_back(area);
  }
  Random random(seed);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = std::lower_bound(area_up_to.begin(), area_up_to.end() - 1, random.uniform() * area);
    const auto& [a, b, c] = mesh_.triangles[static_cast<std::size_t>(at - area_up_to.begin())];
    double u = random.uniform(), v = random.uniform();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    points.push_back(corner(a) + u * (corner(b) - corner(a)) + v * (corner(c) - corner(a)));
  }
  return points;
}

std::vector<OverlapPoint> overlap_points(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b,
                                         const Pose& X_WB, double shallowest_m, double deepest_m) {
  std::vector<OverlapPoint> points;
  AllPoints(b, X_WB, shallowest_m, deepest_m, points).collect(a, X_WB.inverse() * X_WA);
  AllPoints(a, X_WA, shallowest_m, deepest_m, points).collect(b, X_WA.inverse() * X_WB);
  return points;
}

double deepest_overlap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB,
                         double shallowest_m, double deepest_m) {
  Deepest in_b(b, shallowest_m, deepest_m);
  in_b.collect(a, X_WB.inverse() * X_WA);
  Deepest in_a(a, std::max(shallowest_m, in_b.depth_m), deepest_m);
  in_a.collect(b, X_WA.inverse() * X_WB);
  return std::max(in_b.depth_m, in_a.depth_m);
}

double corner_gap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB) {
  double gap = std::numeric_limits<double>::infinity();
  const auto shrink = [&gap](const ExactSurface& from, const ExactSurface& to, const Pose& X_TF) {
    const double halves_m = from.half_thickness_m() + to.half_thickness_m();
    for (const Vec3& corner : from.corners()) {
      const Vec3 p = X_TF * corner;
      if (!to.may_touch(p, gap + halves_m)) continue;
      gap = std::min(gap, std::max(0.0, to.tree().closest(p, gap + halves_m).distance_m - halves_m));
    }
  };
  for (const ExactSurface* of_a : a.parts()) {
    for (const ExactSurface* of_b : b.parts()) {
      shrink(*of_a, *of_b, X_WB.inverse() * X_WA);
      shrink(*of_b, *of_a, X_WA.inverse() * X_WB);
    }
  }
  return gap;
}

}  // namespace tandem::lab
