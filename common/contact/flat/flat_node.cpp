#include "common/contact/flat/flat_node.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <bitset>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "common/contact/flat/flat_runs.hpp"
#include "common/contact/point_shell.hpp"

namespace tandem::contact {
namespace {

// Points are rounded to less than 1 µm along each axis.
constexpr double kFlat_m = 3e-6;
// No shape that was sampled here has more; what bytes from elsewhere can ask for is bounded.
constexpr std::size_t kMaxPoints = 600'000;
// Points that cover a rectangle: fewer are looked at one by one. Of its half sides and their deviations; of its cells.
constexpr std::size_t kMinRectangle = 33;
constexpr std::uint32_t kMinPart = 128;  ///< to have sides of its own
constexpr double kUneven = 0.06;
constexpr double kUnevenCell = 0.3;
constexpr double kUnevenSmallCell = 0.75;
constexpr std::size_t kManyPoints = 256;
// Of the way from point to point: how near to a side some must be, in each part of it that is so wide.
constexpr double kToSide = 1.0;
constexpr double kSideBin = 1.5;
constexpr int kMaxSideBins = 1024;
// Of a box in single precision, 10 cm from the origin.
constexpr float kPointRounding_m = 2e-8F;

/// Sums over points weighted by their area, taken about the first of them.
struct Moments {
  double area_m2 = 0;
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

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

// Of the eigenvalues of a covariance the smallest is at least the determinant over the square of half the trace.
bool is_surely_bent(const Moments& moments) {
  const double half_trace = moments.covariance.trace() / 2;
  return moments.covariance.determinant() > kFlat_m * kFlat_m * half_trace * half_trace;
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

/// Whether there are points all along the sides of a box: what ends before it does is no rectangle of this size.
bool reaches_sides(std::span<const ShellPoint> points, const OrientedBox& box) {
  const double spacing_m = 2 * std::sqrt(box.half_m[0] * box.half_m[1] / static_cast<double>(points.size()));
  for (const int along : {0, 1}) {
    const int across = 1 - along;
    if (box.half_m[across] <= kFlat_m) continue;  // a line
    const bool is_line = box.half_m[along] <= kFlat_m;
    const double most_bins = is_line ? 1 : 2 * box.half_m[along] / (kSideBin * std::max(spacing_m, kFlat_m));
    const auto bins = static_cast<int>(std::clamp<double>(most_bins, 1, kMaxSideBins));
    std::array<std::bitset<kMaxSideBins>, 2> found;
    for (const ShellPoint& point : points) {
      const Vec3 off = box.axes.transpose() * (point.p_S.cast<double>() - box.centre);
      if (box.half_m[across] - std::abs(off[across]) > kToSide * spacing_m) continue;
      const auto bin = is_line ? 0 : static_cast<int>(bins * (off[along] / box.half_m[along] + 1) / 2);
      found[off[across] > 0 ? 1 : 0].set(static_cast<std::size_t>(std::clamp(bin, 0, bins - 1)));
    }
    if (static_cast<int>(found[0].count()) < bins || static_cast<int>(found[1].count()) < bins) return false;
  }
  return true;
}

/// Whether the points have the mean and the covariance of a rectangle, and each of its cells its share of their area.
bool covers_evenly(std::span<const ShellPoint> points, const Moments& moments, const OrientedBox& box) {
  if (points.size() < kMinRectangle) return false;
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
  for (const ShellPoint& point : points) {
    const Vec3 off = box.axes.transpose() * (point.p_S.cast<double>() - box.centre);
    const auto cell = [&](int i) {
      // Of a line, across it, all is in the first.
      const double place = box.half_m[i] <= kFlat_m ? 0 : kCells * (off[i] / box.half_m[i] + 1) / 2;
      return std::clamp(static_cast<int>(place), 0, kCells - 1);
    };
    areas[static_cast<std::size_t>(cell(1) * kCells + cell(0))] += point.area_m2;
  }
  const bool is_line = box.half_m[1] <= kFlat_m || box.half_m[0] <= kFlat_m;
  const double even = moments.area_m2 / (is_line ? kCells : kCells * kCells);
  const double uneven = points.size() >= kManyPoints ? kUnevenCell : kUnevenSmallCell;
  return std::ranges::none_of(
      areas, [&](double area) { return std::abs(area / even - 1) > uneven && !(is_line && area == 0); });
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

/// In      of_part  axes of the flat part that it is in; null: not found yet, and found here
std::optional<FlatNode> flat_node_of(std::span<const ShellPoint> points, const ShellNode& node,
                                     std::optional<Eigen::Matrix3d>& of_part) {
  const Moments moments = moments_of(points);
  const bool must_be = of_part.has_value();
  if (!must_be && is_surely_bent(moments)) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.covariance);
  const Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (!must_be && box_along(points, axes).half_m[2] > kFlat_m) return {};
  if (!must_be) of_part = axes_of_rectangle(points, moments.covariance);
  const auto rectangle_along = [&](const Eigen::Matrix3d& sides) -> std::optional<FlatNode> {
    const OrientedBox box = box_along(points, sides);
    if (!covers_evenly(points, moments, box) || !reaches_sides(points, box)) return {};
    FlatNode flat = node_along(points, node, box.centre, box.half_m / std::numbers::sqrt3, sides);
    flat.is_rectangle = true;
    return flat;
  };
  if (const auto rectangle = rectangle_along(*of_part)) return rectangle;
  // What lies on one plane may be several parts.
  if (must_be && node.count >= kMinPart) {
    const Eigen::Matrix3d own = axes_of_rectangle(points, moments.covariance);
    if (const auto rectangle = rectangle_along(own)) {
      of_part = own;
      return rectangle;
    }
  }
  const Vec3 deviations = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  return node_along(points, node, moments.mean, deviations, axes);
}

}  // namespace

OrientedBox FlatNode::box_S() const {
  Eigen::Matrix3d axes;
  axes << along_S.cast<double>(), across_S.cast<double>(), along_S.cast<double>().cross(across_S.cast<double>());
  return {centre_S.cast<double>(), axes, half_m.cast<double>()};
}

double largest_m(std::span<const FieldPlane> planes, PlaneSet set, const Vec3& p) {
  double largest = -std::numeric_limits<double>::infinity();
  for (; set != 0; set &= set - 1) {
    largest = std::max(largest, planes[static_cast<std::size_t>(std::countr_zero(set))].distance_m(p));
  }
  return largest;
}

PlaneSet largest_over(std::span<const FieldPlane> planes, PlaneSet set, const OrientedBox& box) {
  if (std::has_single_bit(set) || set == 0) return set;
  const FieldPlane* largest = nullptr;
  PlaneSet found = 0;
  for (PlaneSet rest = set; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = planes[static_cast<std::size_t>(std::countr_zero(rest))];
    if (largest != nullptr && plane.distance_m(box.centre) <= largest->distance_m(box.centre)) continue;
    largest = &plane;
    found = rest & -rest;
  }
  for (PlaneSet rest = set & ~found; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = planes[static_cast<std::size_t>(std::countr_zero(rest))];
    const double below = largest->distance_m(box.centre) - plane.distance_m(box.centre);
    if (box.reach_m(plane.normal - largest->normal) > below) found |= rest & -rest;
  }
  return found;
}

std::array<std::uint32_t, 5> quarters_of(const ShellNode& node) {
  const std::uint32_t half = node.count / 2;
  const std::uint32_t middle = node.first + half;
  return {node.first, node.first + half / 2, middle, middle + (node.count - half) / 2, node.first + node.count};
}

std::vector<FlatNode> find_flat_nodes(std::span<const ShellPoint> points, std::span<ShellNode> nodes) {
  std::vector<FlatNode> found;
  if (points.size() > kMaxPoints) return found;
  std::size_t flat_end = 0;  // of the nodes below the last flat one
  std::optional<Eigen::Matrix3d> axes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    ShellNode& node = nodes[i];
    node.flat = ShellNode::kNotFlat;
    if (i >= flat_end) axes.reset();
    if (node.is_leaf && i >= flat_end) continue;
    const auto flat = flat_node_of(points.subspan(node.first, node.count), node, axes);
    if (!flat) continue;
    flat_end = std::max<std::size_t>(flat_end, node.next);
    node.flat = static_cast<std::uint32_t>(found.size());
    found.push_back(*flat);
  }
  found.shrink_to_fit();
  return found;
}

}  // namespace tandem::contact
