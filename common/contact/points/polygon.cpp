#include "common/contact/points/polygon.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

namespace tandem::contact {
namespace {

// A corner is removed if its distance from the line between its neighbours is at most this value.
constexpr double kNoCorner_m = 2e-5;

/// Returns twice the area of the triangle a, b, c; positive if the corners are anticlockwise.
double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d to_b = b - a, to_c = c - a;
  return to_b.x() * to_c.y() - to_b.y() * to_c.x();
}

/// Returns the distance of b from the line through a and c, positive outside of an anticlockwise polygon.
double height(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double length = (c - a).norm();
  return length > 0 ? -cross(a, c, b) / length : (b - a).norm();
}

// Computes the convex hull after Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
std::vector<Eigen::Vector2d> hull_of(std::span<const Eigen::Vector2d> places) {
  std::vector<Eigen::Vector2d> sorted(places.begin(), places.end());
  std::ranges::sort(sorted,
                    [](const auto& a, const auto& b) { return std::tuple(a.x(), a.y()) < std::tuple(b.x(), b.y()); });
  std::vector<Eigen::Vector2d> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t begin = hull.size();
    for (const Eigen::Vector2d& p : sorted) {
      while (hull.size() >= begin + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // the last corner is the first corner of the other half of the hull
    std::ranges::reverse(sorted);
  }
  return hull;
}

/// Change of a polygon that removes one corner or one side.
struct Simpler {
  double change_m = std::numeric_limits<double>::infinity();  ///< largest distance by which the outline changes
  std::size_t removed = 0;
  Eigen::Vector2d next;  ///< new position of the corner after the removed one
};

/// Returns the simplification that changes the outline least. It removes either a corner or a side. The neighbours of a
/// removed side are extended until they meet in a new corner.
Simpler simplest_change(const std::vector<Eigen::Vector2d>& corners) {
  Simpler best;
  const std::size_t count = corners.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d &before = corners[(i + count - 1) % count], &here = corners[i],
                          &next = corners[(i + 1) % count], &after = corners[(i + 2) % count];
    if (const double change_m = height(before, here, next); change_m < best.change_m) best = {change_m, i, next};
    const Eigen::Vector2d side = here - before, other = after - next;
    const double turn = side.x() * other.y() - side.y() * other.x();
    if (!(turn > 0)) continue;  // the neighbouring sides do not meet beyond the removed side
    const Eigen::Vector2d way = next - here;
    const Eigen::Vector2d meet = here + side * ((way.x() * other.y() - way.y() * other.x()) / turn);
    if (const double change_m = height(here, meet, next); change_m < best.change_m) best = {change_m, i, meet};
  }
  return best;
}

}  // namespace

Eigen::Vector2d mean_of(const AreaMoments& moments) {
  return moments.block<2, 1>(1, 0) / moments(0, 0);
}

Eigen::Matrix2d covariance_of(const AreaMoments& moments) {
  const Eigen::Vector2d mean = mean_of(moments);
  return moments.bottomRightCorner<2, 2>() / moments(0, 0) - mean * mean.transpose();
}

Polygon rectangle(const Eigen::Vector2d& half_m) {
  return {Eigen::Vector2d(-half_m.x(), -half_m.y()), Eigen::Vector2d(half_m.x(), -half_m.y()), half_m,
          Eigen::Vector2d(-half_m.x(), half_m.y())};
}

Polygon corners_of(const FlatNode& flat) {
  Polygon polygon;
  for (std::size_t i = 0; i < flat.corner_count; ++i) polygon.push_back(flat.corners_m[i].cast<double>());
  return polygon;
}

Polygon polygon_in_places(std::span<const Eigen::Vector2d> places, double lost_m) {
  const std::vector<Eigen::Vector2d> hull = hull_of(places);
  std::vector<Eigen::Vector2d> left = hull;
  while (left.size() > 3) {
    const Simpler simpler = simplest_change(left);
    if (left.size() <= kMaxFlatCorners && simpler.change_m > kNoCorner_m) break;
    if (simpler.change_m > lost_m) return {};
    left[(simpler.removed + 1) % left.size()] = simpler.next;
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(simpler.removed));
  }
  for (const Eigen::Vector2d& p : hull) {
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (height(left[i], p, left[(i + 1) % left.size()]) > lost_m) return {};
    }
  }
  return {left.begin(), left.end()};
}

// Returns the direction of a side of the smallest rectangle around the polygon. That rectangle has one side along a
// side of the polygon, so only these directions are tried (Freeman & Shapira, "Determining the minimum-area encasing
// rectangle for an arbitrary closed curve", 1975).
Eigen::Vector2d axis_of_box(const Polygon& polygon) {
  Eigen::Vector2d best = Eigen::Vector2d::UnitX();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d side = polygon[i + 1 == polygon.size() ? 0 : i + 1] - polygon[i];
    if (!(side.norm() > 0)) continue;
    const Eigen::Vector2d axis = side.normalized();
    const auto [low_u, high_u] = range(polygon, {0, axis.x(), axis.y()});
    const auto [low_v, high_v] = range(polygon, {0, -axis.y(), axis.x()});
    const double area = (high_u - low_u) * (high_v - low_v);
    if (area >= least) continue;
    least = area;
    best = axis;
  }
  return best;
}

void cut(Polygon& polygon, const DepthSlope& slope) {
  std::array<double, Polygon::static_capacity> above_m;
  std::size_t above = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    above_m[i] = at(slope, polygon[i]);
    above += above_m[i] > 0 ? 1 : 0;
  }
  if (above == 0) return;
  if (above == polygon.size()) return polygon.clear();
  Polygon left;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = i + 1 == polygon.size() ? 0 : i + 1;
    // Cutting a convex polygon adds at most one corner. More corners can arise only if rounding has made the polygon
    // non-convex. They are omitted, which changes the polygon by no more than a rounding error.
    if (left.size() + 2 > left.capacity()) break;
    if (above_m[i] <= 0) left.push_back(polygon[i]);
    if ((above_m[i] <= 0) == (above_m[next] <= 0)) continue;
    const double share = above_m[i] / (above_m[i] - above_m[next]);
    left.emplace_back(polygon[i] + share * (polygon[next] - polygon[i]));
  }
  polygon = left;
}

std::pair<double, double> range(const Polygon& polygon, const DepthSlope& slope) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Eigen::Vector2d& corner : polygon) {
    const double value = at(slope, corner);
    least = std::min(least, value);
    most = std::max(most, value);
  }
  return {least, most};
}

AreaMoments moments_of(const Polygon& polygon) {
  AreaMoments sum = AreaMoments::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& p = polygon[i];
    const Eigen::Vector2d& q = polygon[i + 1 == polygon.size() ? 0 : i + 1];
    const double twice = p.x() * q.y() - q.x() * p.y();  // twice the area of the triangle with the origin
    sum(0, 0) += twice / 2;
    sum(1, 0) += twice * (p.x() + q.x()) / 6;
    sum(2, 0) += twice * (p.y() + q.y()) / 6;
    sum(1, 1) += twice * (p.x() * p.x() + p.x() * q.x() + q.x() * q.x()) / 12;
    sum(2, 2) += twice * (p.y() * p.y() + p.y() * q.y() + q.y() * q.y()) / 12;
    sum(2, 1) += twice * (p.x() * q.y() + 2 * p.x() * p.y() + 2 * q.x() * q.y() + q.x() * p.y()) / 24;
  }
  sum(0, 1) = sum(1, 0);
  sum(0, 2) = sum(2, 0);
  sum(1, 2) = sum(2, 1);
  return sum;
}

}  // namespace tandem::contact
