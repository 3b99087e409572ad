#include "common/contact/points/flat_node.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "common/contact/points/flat_points.hpp"
#include "common/contact/points/flat_runs.hpp"
#include "common/contact/points/point_shell.hpp"

namespace tandem::contact {
namespace {

// Maximum number of points of a shell in which flat nodes are searched. It bounds the work that received bytes can
// cause. Shapes sampled by this program have fewer points.
constexpr std::size_t kMaxPoints = 600'000;
// Nodes with fewer points than this are tried only with the axes of the flat part that contains them.
constexpr std::uint32_t kMinPart = 128;

// Returns whether the points are certainly not on one plane. The test uses a lower bound of the smallest eigenvalue of
// their covariance: the determinant divided by the square of half the trace.
bool is_surely_bent(const Moments& moments) {
  const double half_trace = moments.covariance.trace() / 2;
  return moments.covariance.determinant() > kFlat_m * kFlat_m * half_trace * half_trace;
}

/// In      of_part  axes of the flat part of the surface that contains the node; if empty, they are computed and stored
std::optional<FlatNode> flat_node_of(std::span<const ShellPoint> points, const ShellNode& node,
                                     std::optional<Eigen::Matrix3d>& of_part) {
  const Moments moments = moments_of(points);
  const bool must_be = of_part.has_value();
  if (!must_be) {
    if (is_surely_bent(moments)) return {};
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.covariance);
    if (box_along(points, solver.eigenvectors().rowwise().reverse()).half_m[2] > kFlat_m) return {};
    of_part = axes_of_rectangle(points, moments.covariance);
  }
  if (auto rectangle = rectangle_of(points, node, moments, box_along(points, *of_part))) return rectangle;
  // The points of a large node may belong to several flat parts on the same plane, which have different axes. The node
  // is therefore also tried with axes of its own.
  if (must_be && node.count >= kMinPart) {
    const Eigen::Matrix3d own = axes_of_rectangle(points, moments.covariance);
    if (auto rectangle = rectangle_of(points, node, moments, box_along(points, own))) {
      of_part = own;
      return rectangle;
    }
  }
  if (auto polygon = polygon_of(points, node, moments)) return polygon;
  return node_as_it_is(points, node, moments);
}

}  // namespace

bool FlatNode::has_four_inside() const {
  const Eigen::Vector3f to_mean = mean_S - centre_S;
  return std::abs(along_S.dot(to_mean)) + deviation_along_m <= half_m.x() + kFlat_m &&
         std::abs(across_S.dot(to_mean)) + deviation_across_m <= half_m.y() + kFlat_m;
}

OrientedBox FlatNode::box_S() const {
  Eigen::Matrix3d axes;
  axes << along_S.cast<double>(), across_S.cast<double>(), along_S.cast<double>().cross(across_S.cast<double>());
  return {centre_S.cast<double>(), axes, half_m.cast<double>()};
}

std::array<std::uint32_t, 5> quarters_of(const ShellNode& node) {
  const std::uint32_t half = node.count / 2;
  const std::uint32_t middle = node.first + half;
  return {node.first, node.first + half / 2, middle, middle + (node.count - half) / 2, node.first + node.count};
}

std::vector<FlatNode> find_flat_nodes(std::span<const ShellPoint> points, std::span<ShellNode> nodes) {
  std::vector<FlatNode> found;
  if (points.size() > kMaxPoints) return found;
  std::size_t flat_end = 0;  // end of the subtree of the most recent flat node
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
