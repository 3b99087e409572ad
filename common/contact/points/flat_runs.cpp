#include "common/contact/points/flat_runs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/contact/points/point_shell.hpp"

namespace tandem::contact {
namespace {

// Least number of points of a flat part.
constexpr std::size_t kMinRun = 16;
// Points with similar normals are found by cells of normals. This is the edge of a cell. It is not a simple fraction,
// so that frequent normals, such as those at 30° or 45°, are not at the border of two cells.
constexpr float kNormalCell = 0.0137F;
// Points are sorted by height, their position along the normal. Consecutive points belong to one plane if their heights
// differ by at most this value.
constexpr double kOnePlane_m = 1e-5;
// Least cosine of the angle between normals of one part. These normals differ only by quantization.
constexpr float kSameNormalCosine = 1 - 4e-6F;
// Largest difference in height between consecutive points of one flat part. It is larger than for exact normals: their
// rounding by up to 0.1° tilts the part.
constexpr float kNextPlane_m = 1e-4F;
// Search for the orientation of the smallest rectangle: number of initial angles in 90°, and number of refinements.
// Each refinement reduces the step by a third.
constexpr int kAngles = 24;
constexpr int kNearer = 14;

using Points = std::span<ShellPoint>;

/// Orders points by recursive halving along the longest of three axes.
void order_by_halves(Points points, const Eigen::Matrix3f& axes) {
  if (points.size() <= kShellLeafPoints) return;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  for (const ShellPoint& point : points) {
    const Eigen::Vector3f at = axes.transpose() * point.p_S;
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const Eigen::Vector3f along = axes.col(axis);
  const std::size_t half = points.size() / 2;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half), points.end(),
                   [&along](const ShellPoint& a, const ShellPoint& b) { return along.dot(a.p_S) < along.dot(b.p_S); });
  order_by_halves(points.first(half), axes);
  order_by_halves(points.subspan(half), axes);
}

std::array<int, 3> normal_cell(const ShellPoint& point) {
  const auto cell = [&](int axis) { return static_cast<int>(std::lround(point.normal_S[axis] / kNormalCell)); };
  return {cell(0), cell(1), cell(2)};
}

/// Points of one flat part.
struct Part {
  std::vector<std::uint32_t> points;
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();
};

/// Finds the flat parts of the surface among points whose normals are in one cell, and appends them to `parts`.
void add_parts(std::span<const ShellPoint> points, std::span<std::uint32_t> alike, std::vector<Part>& parts) {
  const Vec3 normal = points[alike.front()].normal_S.cast<double>();
  const auto height = [&](std::uint32_t i) { return normal.dot(points[i].p_S.cast<double>()); };
  std::ranges::stable_sort(alike, std::less{}, height);
  for (std::size_t begin = 0; begin < alike.size();) {
    std::size_t end = begin + 1;
    while (end < alike.size() && height(alike[end]) - height(alike[end - 1]) < kOnePlane_m) ++end;
    const auto part = alike.subspan(begin, end - begin);
    begin = end;
    const Eigen::Vector3f& first = points[part.front()].normal_S;
    const auto faces_alike = [&](std::uint32_t i) { return points[i].normal_S.dot(first) >= kSameNormalCosine; };
    if (part.size() < kMinRun || !std::ranges::all_of(part, faces_alike)) continue;
    Part found{{part.begin(), part.end()}, Eigen::Vector3f::Zero()};
    std::ranges::sort(found.points);
    for (const std::uint32_t i : part) found.middle += points[i].p_S / static_cast<float>(part.size());
    parts.push_back(std::move(found));
  }
}

void order_parts(std::span<Part> parts) {
  if (parts.size() < 2) return;
  Eigen::Vector3f low = parts.front().middle, high = low;
  for (const Part& part : parts) {
    low = low.cwiseMin(part.middle);
    high = high.cwiseMax(part.middle);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  std::ranges::stable_sort(parts, std::less{}, [axis](const Part& part) { return part.middle[axis]; });
  order_parts(parts.first(parts.size() / 2));
  order_parts(parts.subspan(parts.size() / 2));
}

Eigen::Matrix3d covariance_of(std::span<const ShellPoint> points) {
  Vec3 sum = Vec3::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  const Vec3 origin = points.front().p_S.cast<double>();
  for (const ShellPoint& point : points) {
    const Vec3 p = point.p_S.cast<double>() - origin;
    sum += p;
    squares += p * p.transpose();
  }
  const auto count = static_cast<double>(points.size());
  return squares / count - sum * sum.transpose() / (count * count);
}

}  // namespace

void order_by_parts(std::vector<ShellPoint>& points) {
  std::vector<std::uint32_t> by_cell(points.size());
  std::iota(by_cell.begin(), by_cell.end(), 0U);
  const auto cell_of = [&points](std::uint32_t i) { return normal_cell(points[i]); };
  std::ranges::stable_sort(by_cell, std::less{}, cell_of);
  std::vector<Part> parts;
  for (auto begin = by_cell.begin(); begin != by_cell.end();) {
    const auto end = std::find_if(begin, by_cell.end(), [&](std::uint32_t i) { return cell_of(i) != cell_of(*begin); });
    add_parts(points, {begin, end}, parts);
    begin = end;
  }
  order_parts(parts);
  std::vector<bool> is_in_part(points.size());
  for (const Part& part : parts) {
    for (const std::uint32_t i : part.points) is_in_part[i] = true;
  }
  std::vector<ShellPoint> ordered;
  ordered.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_in_part[i]) ordered.push_back(points[i]);
  }
  order_by_halves(ordered, Eigen::Matrix3f::Identity());
  for (const Part& part : parts) {
    const std::size_t begin = ordered.size();
    for (const std::uint32_t i : part.points) ordered.push_back(points[i]);
    const Points of_part = Points(ordered).subspan(begin);
    order_by_halves(of_part, axes_of_rectangle(of_part, covariance_of(of_part)).cast<float>());
  }
  points = std::move(ordered);
}

std::vector<std::uint32_t> borders_of_parts(std::span<const ShellPoint> points) {
  std::vector<std::uint32_t> borders;
  const auto add = [&](std::size_t border) {
    if (border > 0 && border < points.size() && (borders.empty() || borders.back() != border)) {
      borders.push_back(static_cast<std::uint32_t>(border));
    }
  };
  for (std::size_t begin = 0; begin < points.size();) {
    const Eigen::Vector3f& normal = points[begin].normal_S;
    std::size_t end = begin + 1;
    while (end < points.size() && normal.dot(points[end].normal_S) >= kSameNormalCosine &&
           std::abs(normal.dot(points[end].p_S - points[end - 1].p_S)) < kNextPlane_m) {
      ++end;
    }
    if (end - begin >= kMinRun) {
      add(begin);
      add(end);
    }
    begin = end;
  }
  return borders;
}

Eigen::Matrix3d axes_of_rectangle(std::span<const ShellPoint> points, const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  // If the points are on a line, the rectangles at all angles have the same area. The axes of the covariance are used
  // instead.
  if (solver.eigenvalues()[1] <= 1e-6 * solver.eigenvalues()[2]) return axes;
  std::vector<Eigen::Vector2d> places;
  places.reserve(points.size());
  const Vec3 origin = points.front().p_S.cast<double>();
  for (const ShellPoint& point : points) {
    places.emplace_back(axes.leftCols<2>().transpose() * (point.p_S.cast<double>() - origin));
  }
  const auto area_at = [&places](double angle) {
    const Eigen::Vector2d u(std::cos(angle), std::sin(angle)), v(-u.y(), u.x());
    double low_u = 0, high_u = 0, low_v = 0, high_v = 0;
    for (const Eigen::Vector2d& place : places) {
      const double at_u = u.dot(place), at_v = v.dot(place);
      low_u = std::min(low_u, at_u);
      high_u = std::max(high_u, at_u);
      low_v = std::min(low_v, at_v);
      high_v = std::max(high_v, at_v);
    }
    return (high_u - low_u) * (high_v - low_v);
  };
  double best = 0, least = std::numeric_limits<double>::infinity();
  const auto try_angle = [&](double angle) {
    const double area = area_at(angle);
    if (area >= least) return;
    least = area;
    best = angle;
  };
  double step = std::numbers::pi / 2 / kAngles;
  for (int i = 0; i < kAngles; ++i) try_angle(i * step);
  for (int i = 0; i < kNearer; ++i) {
    step *= 2.0 / 3;
    const double middle = best;
    try_angle(middle - step);
    try_angle(middle + step);
  }
  const Vec3 along = std::cos(best) * axes.col(0) + std::sin(best) * axes.col(1);
  axes.col(1) = std::cos(best) * axes.col(1) - std::sin(best) * axes.col(0);
  axes.col(0) = along;
  return axes;
}

}  // namespace tandem::contact
