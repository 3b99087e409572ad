#include "common/contact/flat/flat_points.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "common/contact/point_shell.hpp"

namespace tandem::contact {
namespace {

// Of a place along a side, beyond the surface: samples of a field err at sharp edges by up to a tenth of a millimetre.
constexpr double kBeyond_m = 1.1e-4;
// Points that cover a rectangle: fewer are looked at one by one. Of its half sides and their deviations; of its cells.
constexpr std::size_t kMinRectangle = 33;
constexpr double kUneven = 0.06;
constexpr double kUnevenCell = 0.3;
constexpr double kUnevenSmallCell = 0.75;
constexpr std::size_t kManyPoints = 256;
// Of the way from point to point: what is so wide each way, and on the surface, has a point in it.
constexpr double kPart = 2;
// Of a box in single precision, 10 cm from the origin.
constexpr float kPointRounding_m = 2e-8F;

/// Of so many cells along each side of a box, the one that a point is in; of a line, across it, the first.
std::size_t cell_of(const ShellPoint& point, const OrientedBox& box, const Eigen::Array2i& cells) {
  const Vec3 off = box.axes.transpose() * (point.p_S.cast<double>() - box.centre);
  const auto cell = [&](int i) {
    const double place = box.half_m[i] <= kFlat_m ? 0 : cells[i] * (off[i] / box.half_m[i] + 1) / 2;
    return std::clamp(static_cast<int>(place), 0, cells[i] - 1);
  };
  return static_cast<std::size_t>(cell(1) * cells[0] + cell(0));
}

/// Whether each small part of a box has a point: what is missing, of a side or from a hole, has no such part in it.
bool has_no_hole(std::span<const ShellPoint> points, const OrientedBox& box) {
  if (box.half_m.head<2>().minCoeff() <= kFlat_m) return true;  // a line
  const auto count = static_cast<double>(points.size());
  const double part_m = kPart * 2 * std::sqrt(box.half_m[0] * box.half_m[1] / count);
  const auto parts_along = [&](int axis) { return std::max(1.0, std::floor(2 * box.half_m[axis] / part_m)); };
  const Eigen::Array2d parts(parts_along(0), parts_along(1));
  if (!(parts.prod() <= count)) return false;  // narrow: there are fewer points
  std::vector<bool> is_empty(static_cast<std::size_t>(parts.prod()), true);
  for (const ShellPoint& point : points) is_empty[cell_of(point, box, parts.cast<int>())] = false;
  return std::ranges::find(is_empty, true) == is_empty.end();
}

/// Whether the points have the mean and the covariance of a rectangle, and each of its cells its share of their area.
bool has_even_cells(std::span<const ShellPoint> points, const Moments& moments, const OrientedBox& box) {
  // Axes of another line in the plane may be those of another plane.
  if (points.size() < kMinRectangle || box.half_m[2] > 2 * kFlat_m) return false;
  const Vec3 way = (box.axes.transpose() * (moments.mean - box.centre)).cwiseAbs();
  const Eigen::Matrix3d covariance = box.axes.transpose() * moments.covariance * box.axes;
  for (int i = 0; i < 2; ++i) {
    if (box.half_m[i] <= kFlat_m) continue;  // a line
    const double deviation_m = box.half_m[i] / std::numbers::sqrt3;
    if (way[i] > kUneven * box.half_m[i]) return false;
    if (std::abs(std::sqrt(covariance(i, i)) - deviation_m) > kUneven * deviation_m) return false;
  }
  constexpr int kCells = 4;  // along each side; nothing in one of them is no rectangle
  std::array<double, std::size_t{kCells} * kCells> areas{};
  for (const ShellPoint& point : points) areas[cell_of(point, box, {kCells, kCells})] += point.area_m2;
  const bool is_line = box.half_m[1] <= kFlat_m || box.half_m[0] <= kFlat_m;
  const double even = moments.area_m2 / (is_line ? kCells : kCells * kCells);
  const double uneven = points.size() >= kManyPoints ? kUnevenCell : kUnevenSmallCell;
  return std::ranges::none_of(
      areas, [&](double area) { return std::abs(area / even - 1) > uneven && !(is_line && area == 0); });
}

/// Whether one of some places along the sides of a rectangle is outside of what has this field.
bool reaches_beyond(const OrientedBox& rectangle, const DistanceField& field) {
  constexpr int kSteps = 4;  // of each side
  for (int u = 0; u <= kSteps; ++u) {
    for (int v = 0; v <= kSteps; v += u == 0 || u == kSteps ? 1 : kSteps) {
      const Eigen::Vector2d place(2.0 * u / kSteps - 1, 2.0 * v / kSteps - 1);
      const Vec3 p_S = rectangle.centre + rectangle.axes.leftCols<2>() * rectangle.half_m.head<2>().cwiseProduct(place);
      if (field.distance_m(p_S) > kBeyond_m) return true;
    }
  }
  return false;
}

/// Of the ways to name and direct the axes, the one in which the four points are nearest to the means of the quarters.
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

bool cover_rectangle(std::span<const ShellPoint> points, const Moments& moments, const OrientedBox& box) {
  return has_even_cells(points, moments, box) && has_no_hole(points, box);
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
  return {mean.cast<float>(),
          axes.col(0).cast<float>(),
          axes.col(1).cast<float>(),
          static_cast<float>(deviations[0]),
          static_cast<float>(deviations[1]),
          box.centre.cast<float>(),
          box.half_m.cast<float>() + Eigen::Vector3f::Constant(kPointRounding_m)};
}

FlatNode node_as_it_is(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.covariance);
  const Vec3 deviations = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  return node_along(points, node, moments.mean, deviations, solver.eigenvectors().rowwise().reverse());
}

void drop_rectangles_off(const DistanceField& field, PointShell& shell) {
  for (const ShellNode& node : shell.nodes) {
    if (node.flat == ShellNode::kNotFlat) continue;
    FlatNode& flat = shell.flat_nodes[node.flat];
    if (!flat.is_rectangle || !reaches_beyond(flat.box_S(), field)) continue;
    const auto points = std::span<const ShellPoint>(shell.points).subspan(node.first, node.count);
    flat = node_as_it_is(points, node, moments_of(points));
  }
}

}  // namespace tandem::contact
