#include "common/contact/points/flat_points.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "common/contact/points/point_shell.hpp"
#include "common/contact/points/polygon.hpp"

namespace tandem::contact {
namespace {

// Largest distance by which a polygon may extend beyond the field's surface. It is not zero, because samples of a field
// have errors of up to 0.1 mm at sharp edges.
constexpr double kBeyond_m = 1.1e-4;
// Criteria for points that cover a polygon evenly.
// * kMinPolygon: minimum number of points; the points of a smaller node are used singly.
// * kUneven: relative tolerance of the mean and deviations of a rectangle.
// * kUnevenCell: relative tolerance of the area in a cell, for nodes with at least kManyPoints points.
// * kUnevenSmallCell: the same tolerance for smaller nodes.
constexpr std::size_t kMinPolygon = 33;
constexpr double kUneven = 0.06;
constexpr double kUnevenCell = 0.3;
constexpr double kUnevenSmallCell = 0.75;
constexpr std::size_t kManyPoints = 256;
// To find holes, a polygon is divided into square parts. A part without a point is a hole. This is the edge of a part,
// in spacings of points.
constexpr double kPart = 2;
// Least fraction of a part that must be inside the polygon for the part to be checked.
constexpr double kWholePart = 0.8;
// Tolerances of a polygon: kLost_m is the distance by which a point may be outside of it. kMaxShift_m is the distance
// by which its sides may be moved from the convex hull of the points.
constexpr double kLost_m = 2e-4;
constexpr double kMaxShift_m = 3e-4;
// If the standard deviation of a node's points across their longest direction is smaller than this value, the node is a
// line.
constexpr double kMinDeviation_m = 5e-4;
// Least half width of a line.
constexpr double kThinnest_m = 1e-7;
// Upper bound of the rounding error of a box's size in single precision, up to 10 cm from the origin.
constexpr float kPointRounding_m = 2e-8F;

/// Returns the index of the cell of a box that contains a point. `cells` is the number of cells along each side. A line
/// has one cell across its width.
std::size_t cell_of(const ShellPoint& point, const OrientedBox& box, const Eigen::Array2i& cells) {
  const Vec3 off = box.axes.transpose() * (point.p_S.cast<double>() - box.centre);
  const auto cell = [&](int i) {
    const double place = box.half_m[i] <= kFlat_m ? 0 : cells[i] * (off[i] / box.half_m[i] + 1) / 2;
    return std::clamp(static_cast<int>(place), 0, cells[i] - 1);
  };
  return static_cast<std::size_t>(cell(1) * cells[0] + cell(0));
}

/// Calls visit(index, share) for each cell of a box, where `share` is the fraction of the cell inside a polygon. The
/// polygon's coordinates are relative to the box's middle.
template <typename Visit>
void for_cells(const Polygon& polygon, const OrientedBox& box, const Eigen::Array2i& cells, const Visit& visit) {
  const Eigen::Vector2d half_m = box.half_m.head<2>().cwiseMax(kThinnest_m);
  const Eigen::Array2d size_m = 2 * half_m.array() / cells.cast<double>();
  for (int v = 0; v < cells[1]; ++v) {
    for (int u = 0; u < cells[0]; ++u) {
      const Eigen::Array2d low_m = size_m * Eigen::Array2d(u, v) - half_m.array();
      const Eigen::Array2d high_m = low_m + size_m;
      Polygon part = polygon;
      cut(part, {low_m[0], -1, 0});
      cut(part, {-high_m[0], 1, 0});
      cut(part, {low_m[1], 0, -1});
      cut(part, {-high_m[1], 0, 1});
      const double share = moments_of(part)(0, 0) / size_m.prod();
      visit(static_cast<std::size_t>(v * cells[0] + u), share);
    }
  }
}

/// Returns false if a part of a polygon contains no point although most of the part is inside the polygon. The polygon
/// then has a hole, or a side that the points do not reach.
bool has_no_hole(std::span<const ShellPoint> points, const OrientedBox& box, const Polygon& polygon) {
  if (box.half_m.head<2>().minCoeff() <= kFlat_m) return true;  // the node is a line, which has no holes
  const auto count = static_cast<double>(points.size());
  const double part_m = kPart * std::sqrt(moments_of(polygon)(0, 0) / count);
  const auto parts_along = [&](int axis) { return std::max(1.0, std::floor(2 * box.half_m[axis] / part_m)); };
  const Eigen::Array2d parts(parts_along(0), parts_along(1));
  // In a narrow polygon, there are more parts than points, so a part without a point need not be a hole. Such a polygon
  // is rejected.
  if (!(parts.prod() * moments_of(polygon)(0, 0) <= count * 4 * box.half_m[0] * box.half_m[1])) return false;
  std::vector<bool> is_empty(static_cast<std::size_t>(parts.prod()), true);
  for (const ShellPoint& point : points) is_empty[cell_of(point, box, parts.cast<int>())] = false;
  bool has_hole = false;
  for_cells(polygon, box, parts.cast<int>(),
            [&](std::size_t part, double share) { has_hole = has_hole || (is_empty[part] && share > kWholePart); });
  return !has_hole;
}

/// Returns whether the points cover a polygon evenly: the area of the points in each cell must be in proportion to the
/// cell's area inside the polygon.
bool has_even_cells(std::span<const ShellPoint> points, const Moments& moments, const OrientedBox& box,
                    const Polygon& polygon) {
  // The axes may come from points on a line. They then need not be in the plane of the node's points, and the box is
  // too thick.
  if (points.size() < kMinPolygon || box.half_m[2] > 2 * kFlat_m) return false;
  constexpr int kCells = 4;  // number of cells along each side; an empty cell rejects the polygon
  Eigen::Array2i cells(kCells, kCells);
  for (int i = 0; i < 2; ++i) {
    if (box.half_m[i] <= kFlat_m) cells[i] = 1;
  }
  std::array<double, std::size_t{kCells} * kCells> areas{};
  for (const ShellPoint& point : points) areas[cell_of(point, box, cells)] += point.area_m2;
  const Eigen::Vector2d half_m = box.half_m.head<2>().cwiseMax(kThinnest_m);
  const double even = moments.area_m2 * 4 * half_m.prod() / (cells.prod() * moments_of(polygon)(0, 0));
  const double uneven = points.size() >= kManyPoints ? kUnevenCell : kUnevenSmallCell;
  bool is_even = true;
  for_cells(polygon, box, cells, [&](std::size_t cell, double share) {
    is_even = is_even && std::abs(areas[cell] / even - share) <= uneven;
  });
  return is_even;
}

/// Returns whether the moments of the points equal those of an evenly covered rectangle.
bool has_moments_of(const Moments& moments, const OrientedBox& box) {
  const Vec3 way = (box.axes.transpose() * (moments.mean - box.centre)).cwiseAbs();
  const Eigen::Matrix3d covariance = box.axes.transpose() * moments.covariance * box.axes;
  for (int i = 0; i < 2; ++i) {
    if (box.half_m[i] <= kFlat_m) continue;  // a line has no extent along this axis
    const double deviation_m = box.half_m[i] / std::numbers::sqrt3;
    if (way[i] > kUneven * box.half_m[i]) return false;
    if (std::abs(std::sqrt(covariance(i, i)) - deviation_m) > kUneven * deviation_m) return false;
  }
  return true;
}

/// Returns whether a polygon extends outside of the field's surface. The check samples points on its sides, and between
/// its sides and its mean.
bool reaches_beyond(const FlatNode& flat, const DistanceField& field) {
  constexpr double kStep_m = 1.5e-3;
  constexpr int kMinSteps = 4, kMaxSteps = 32, kRounds = 3;
  const OrientedBox box = flat.box_S();
  const Polygon polygon = corners_of(flat);
  for (std::size_t i = 0; i < flat.corner_count; ++i) {
    const Eigen::Vector2d& corner = polygon[i];
    const Eigen::Vector2d side = polygon[(i + 1) % flat.corner_count] - corner;
    const int steps = std::clamp(static_cast<int>(std::ceil(side.norm() / kStep_m)), kMinSteps, kMaxSteps);
    for (int step = 0; step < steps; ++step) {
      const Eigen::Vector2d place = corner + side * step / steps;
      for (int round = 0; round < kRounds; ++round) {
        const Vec3 p_S = flat.mean_S.cast<double>() + box.axes.leftCols<2>() * (place * (kRounds - round) / kRounds);
        if (field.distance_m(p_S) > kBeyond_m) return true;
      }
    }
  }
  return false;
}

/// Chooses the order and the signs of the axes. They determine which of the four points at mean ± deviations represents
/// which quarter of the node's points (quarters_of()). Each of the four points must be near the mean of its quarter.
void direct_axes(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments, Vec3& deviations,
                 Eigen::Matrix3d& axes) {
  const auto quarters = quarters_of(node);
  std::array<Vec3, 4> offsets;
  for (std::size_t k = 0; k < 4; ++k) {
    offsets[k] =
        moments_of(points.subspan(quarters[k] - node.first, quarters[k + 1] - quarters[k])).mean - moments.mean;
  }
  const Vec3 of_halves = axes.transpose() * (offsets[2] + offsets[3] - offsets[0] - offsets[1]);
  const Vec3 in_halves = axes.transpose() * (offsets[1] + offsets[3] - offsets[0] - offsets[2]);
  const double as_is = std::abs(of_halves[0]) * deviations[0] + std::abs(in_halves[1]) * deviations[1];
  const double swapped = std::abs(of_halves[1]) * deviations[1] + std::abs(in_halves[0]) * deviations[0];
  const bool is_swapped = swapped > as_is;
  if (is_swapped) {
    axes.col(0).swap(axes.col(1));
    std::swap(deviations[0], deviations[1]);
  }
  if (of_halves[is_swapped ? 1 : 0] < 0) axes.col(0) = -axes.col(0);
  if (in_halves[is_swapped ? 0 : 1] < 0) axes.col(1) = -axes.col(1);
  axes.col(2) = axes.col(0).cross(axes.col(1));
}

}  // namespace

Moments moments_of(std::span<const ShellPoint> points) {
  Moments sum;
  const Vec3 origin = points.front().p_S.cast<double>();
  for (const ShellPoint& point : points) {
    const Vec3 p = point.p_S.cast<double>() - origin;
    const double area = point.area_m2;
    sum.area_m2 += area;
    sum.mean += area * p;
    sum.covariance += area * p * p.transpose();
  }
  if (!(sum.area_m2 > 0)) return {0, origin, Eigen::Matrix3d::Zero()};
  sum.mean /= sum.area_m2;
  sum.covariance = sum.covariance / sum.area_m2 - sum.mean * sum.mean.transpose();
  sum.mean += origin;
  return sum;
}

OrientedBox box_along(std::span<const ShellPoint> points, const Eigen::Matrix3d& axes) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  for (const ShellPoint& point : points) {
    const Vec3 p = axes.transpose() * point.p_S.cast<double>();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3 half = (high - low) / 2;
  return {axes * (low + half), axes, half};
}

FlatNode node_along(std::span<const ShellPoint> points, const ShellNode& node, const Vec3& mean, Vec3 deviations,
                    Eigen::Matrix3d axes) {
  Moments moments;
  moments.mean = mean;
  if (!node.is_leaf) direct_axes(points, node, moments, deviations, axes);
  const OrientedBox box = box_along(points, axes);
  FlatNode flat;
  flat.mean_S = mean.cast<float>();
  flat.along_S = axes.col(0).cast<float>();
  flat.across_S = axes.col(1).cast<float>();
  flat.deviation_along_m = static_cast<float>(deviations[0]);
  flat.deviation_across_m = static_cast<float>(deviations[1]);
  flat.centre_S = box.centre.cast<float>();
  flat.half_m = box.half_m.cast<float>() + Eigen::Vector3f::Constant(kPointRounding_m);
  return flat;
}

namespace {

/// Sets the corners of a flat node's polygon, given in S, and enlarges the node's box to contain them.
void set_corners(FlatNode& flat, std::span<const Vec3> corners_S) {
  const Eigen::Matrix3d axes = flat.box_S().axes;
  const Vec3 middle = axes.transpose() * (flat.centre_S - flat.mean_S).cast<double>();
  Vec3 low = middle - flat.half_m.cast<double>(), high = middle + flat.half_m.cast<double>();
  for (const Vec3& corner_S : corners_S) {
    const Vec3 corner = axes.transpose() * (corner_S - flat.mean_S.cast<double>());
    low.head<2>() = low.head<2>().cwiseMin(corner.head<2>());
    high.head<2>() = high.head<2>().cwiseMax(corner.head<2>());
    flat.corners_m[flat.corner_count++] = corner.head<2>().cast<float>();
  }
  const auto corners = std::span(flat.corners_m).first(flat.corner_count);
  if (moments_of(corners_of(flat))(0, 0) < 0) std::ranges::reverse(corners);
  flat.centre_S = (flat.mean_S.cast<double>() + axes * (low + high) / 2).cast<float>();
  flat.half_m = ((high - low) / 2).cast<float>();
}

/// Returns whether each side of a polygon has moved by at most kMaxShift_m.
bool has_sides_near(const Polygon& now, const Polygon& before) {
  const std::size_t count = now.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = (i + 1) % count;
    const Eigen::Vector2d side = (before[next] - before[i]).normalized();
    for (const std::size_t end : {i, next}) {
      const Eigen::Vector2d shift = now[end] - before[end];
      if (!(std::abs(side.x() * shift.y() - side.y() * shift.x()) <= kMaxShift_m)) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<FlatNode> rectangle_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments,
                                     const OrientedBox& box) {
  const Polygon sides = rectangle(box.half_m.head<2>().cwiseMax(kThinnest_m));
  if (!has_moments_of(moments, box) || !has_even_cells(points, moments, box, sides)) return {};
  if (!has_no_hole(points, box, sides)) return {};
  FlatNode flat = node_along(points, node, box.centre, box.half_m / std::numbers::sqrt3, box.axes);
  std::array<Vec3, 4> corners_S;
  for (std::size_t i = 0; i < 4; ++i) corners_S[i] = box.centre + box.axes.leftCols<2>() * sides[i];
  set_corners(flat, corners_S);
  return flat;
}

std::optional<FlatNode> polygon_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments) {
  if (points.size() < kMinPolygon) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.covariance);
  if (!(solver.eigenvalues()[1] > kMinDeviation_m * kMinDeviation_m)) return {};
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  std::vector<Eigen::Vector2d> places;
  places.reserve(points.size());
  for (const ShellPoint& point : points) {
    places.emplace_back(axes.leftCols<2>().transpose() * (point.p_S.cast<double>() - moments.mean));
  }
  Polygon polygon = polygon_in_places(places, kLost_m);
  if (is_empty(polygon)) return {};
  const Eigen::Vector2d along = axis_of_box(polygon);
  const Eigen::Matrix2d turn = (Eigen::Matrix2d() << along.x(), -along.y(), along.y(), along.x()).finished();
  axes.leftCols<2>() = (axes.leftCols<2>() * turn).eval();
  for (Eigen::Vector2d& corner : polygon) corner = (turn.transpose() * corner).eval();
  // The hull is stretched until its mean and covariance equal those of the points. Its sides pass through the outermost
  // points of the node; stretching moves them outwards by about half of the spacing of the points.
  const AreaMoments sum = moments_of(polygon);
  const Eigen::Matrix2d covariance = (axes.transpose() * moments.covariance * axes).topLeftCorner<2, 2>();
  const Eigen::LLT<Eigen::Matrix2d> from(covariance_of(sum)), to(covariance);
  if (from.info() != Eigen::Success || to.info() != Eigen::Success) return {};
  const Eigen::Matrix2d change = to.matrixL().toDenseMatrix() * from.matrixL().toDenseMatrix().inverse();
  const Polygon hull = polygon;
  for (Eigen::Vector2d& corner : polygon) corner = change * (corner - mean_of(sum));
  if (!has_sides_near(polygon, hull)) return {};
  FlatNode flat =
      node_along(points, node, moments.mean, Vec3(std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)), 0), axes);
  std::vector<Vec3> corners_S;
  for (const Eigen::Vector2d& corner : polygon) corners_S.push_back(moments.mean + axes.leftCols<2>() * corner);
  set_corners(flat, corners_S);
  const OrientedBox box = flat.box_S();
  Polygon about_middle = corners_of(flat);
  const Eigen::Vector2d middle = (box.axes.transpose() * (box.centre - flat.mean_S.cast<double>())).head<2>();
  for (Eigen::Vector2d& corner : about_middle) corner -= middle;
  if (!has_even_cells(points, moments, box, about_middle) || !has_no_hole(points, box, about_middle)) return {};
  return flat;
}

FlatNode node_as_it_is(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.covariance);
  const Vec3 deviations = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  return node_along(points, node, moments.mean, deviations, solver.eigenvectors().rowwise().reverse());
}

void drop_polygons_off(const DistanceField& field, PointShell& shell) {
  for (const ShellNode& node : shell.nodes) {
    if (node.flat == ShellNode::kNotFlat) continue;
    FlatNode& flat = shell.flat_nodes[node.flat];
    if (!flat.is_polygon() || !reaches_beyond(flat, field)) continue;
    const auto points = std::span<const ShellPoint>(shell.points).subspan(node.first, node.count);
    const Moments moments = moments_of(points);
    // The rejected polygon may be a rectangle of which the surface lacks a corner. The points may then form a polygon
    // without this corner.
    const std::optional<FlatNode> polygon = polygon_of(points, node, moments);
    flat = polygon && !reaches_beyond(*polygon, field) ? *polygon : node_as_it_is(points, node, moments);
  }
}

}  // namespace tandem::contact
