#include "common/geometry/polygon.hpp"

#include <algorithm>

namespace tandem::geometry {
namespace {

double cross(const Vec2& a, const Vec2& b) noexcept {
  return a.x() * b.y() - a.y() * b.x();
}

/// Polygon of an intersection. Each edge of the other polygon adds at most one corner when it clips this polygon.
using Clipped = boost::container::static_vector<Vec2, 2 * kMaxConvexCorners + 2>;

/// Keeps the part of `polygon` on the left of the line from a to b.
void clip(Clipped& polygon, const Vec2& a, const Vec2& b) noexcept {
  Clipped kept;
  const Vec2 along = b - a;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& p = polygon[i];
    const Vec2& q = polygon[(i + 1) % polygon.size()];
    const double of_p = cross(along, p - a), of_q = cross(along, q - a);
    if (of_p >= 0 && kept.size() < kept.capacity()) kept.push_back(p);
    if ((of_p < 0) != (of_q < 0) && kept.size() < kept.capacity()) kept.push_back(p + (q - p) * (of_p / (of_p - of_q)));
  }
  polygon = kept;
}

bool is_inside(const Vec2& p, const Triangle2& t) noexcept {
  return cross(t[1] - t[0], p - t[0]) >= 0 && cross(t[2] - t[1], p - t[1]) >= 0 && cross(t[0] - t[2], p - t[2]) >= 0;
}

/// Returns whether corner i is an ear: convex, and no other corner lies in its triangle.
bool is_ear(const std::vector<Vec2>& polygon, std::size_t i) {
  const std::size_t n = polygon.size();
  const Triangle2 ear{polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]};
  if (cross(ear[1] - ear[0], ear[2] - ear[1]) <= 0) return false;
  for (std::size_t j = 0; j < n; ++j) {
    const bool is_corner = j == i || j == (i + 1) % n || j == (i + n - 1) % n;
    if (!is_corner && is_inside(polygon[j], ear)) return false;
  }
  return true;
}

/// Returns whether two segments cross between their ends.
bool do_cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) noexcept {
  const double of_c = cross(b - a, c - a), of_d = cross(b - a, d - a);
  const double of_a = cross(d - c, a - c), of_b = cross(d - c, b - c);
  return (of_c < 0) != (of_d < 0) && (of_a < 0) != (of_b < 0);
}

bool crosses_itself(std::span<const Vec2> polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;  // neighbouring sides meet at a corner and do not cross
      if (do_cross(polygon[i], polygon[i + 1], polygon[j], polygon[(j + 1) % n])) return true;
    }
  }
  return false;
}

}  // namespace

double signed_area(std::span<const Vec2> polygon) noexcept {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return twice / 2;
}

Vec2 centroid(std::span<const Vec2> polygon) noexcept {
  Vec2 sum = Vec2::Zero();
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& p = polygon[i];
    const Vec2& q = polygon[(i + 1) % polygon.size()];
    const double part = cross(p, q);
    sum += part * (p + q);
    twice += part;
  }
  return twice != 0 ? Vec2(sum / (3 * twice)) : polygon.front();
}

double common_area(std::span<const Vec2> a, std::span<const Vec2> b) noexcept {
  Clipped polygon(a.begin(), a.end());
  for (std::size_t i = 0; i < b.size() && polygon.size() >= 3; ++i) clip(polygon, b[i], b[(i + 1) % b.size()]);
  return polygon.size() < 3 ? 0 : std::max(0.0, signed_area(polygon));
}

std::vector<Triangle2> triangulate(std::span<const Vec2> polygon) {
  if (polygon.size() < 3 || signed_area(polygon) <= 0 || crosses_itself(polygon)) return {};
  std::vector<Vec2> rest(polygon.begin(), polygon.end());
  std::vector<Triangle2> triangles;
  while (rest.size() > 3) {
    std::size_t ear = 0;
    while (ear < rest.size() && !is_ear(rest, ear)) ++ear;
    if (ear == rest.size()) return {};
    const std::size_t n = rest.size();
    triangles.push_back({rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({rest[0], rest[1], rest[2]});
  return triangles;
}

/// A polygon is convex if it turns left at each corner and goes around only once.
bool is_convex(std::span<const Vec2> polygon) noexcept {
  const std::size_t n = polygon.size();
  int down = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 in = polygon[(i + 1) % n] - polygon[i], out = polygon[(i + 2) % n] - polygon[(i + 1) % n];
    if (cross(in, out) <= 0) return false;
    if (in.y() < 0 && out.y() >= 0) ++down;
  }
  return n >= 3 && down <= 1;
}

}  // namespace tandem::geometry
