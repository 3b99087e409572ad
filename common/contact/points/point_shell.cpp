#include "common/contact/points/point_shell.hpp"

#include <algorithm>
#include <limits>

#include "common/contact/points/flat_runs.hpp"

namespace tandem::contact {
namespace {

// Number of iterations that make a ball around points smaller. Iteration i moves the centre towards the farthest point
// by 1/(i + 1) of its distance. After these iterations, the radius is within a few per cent of the smallest one (Bădoiu
// & Clarkson, "Smaller core-sets for balls", 2003).
constexpr int kBallRounds = 8;
// If all points of a node are within this distance of a plane, their mean may represent them.
constexpr double kFlatBulge_m = 1e-5;

struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius_m = 0;
};

Ball ball_around(const Vec3& centre, std::span<const ShellPoint> points, Vec3& farthest) {
  double largest = -1;
  for (const ShellPoint& point : points) {
    const Vec3 p = point.p_S.cast<double>();
    const double squared = (p - centre).squaredNorm();
    if (squared <= largest) continue;
    largest = squared;
    farthest = p;
  }
  return {centre, std::sqrt(largest)};
}

Ball small_ball(std::span<const ShellPoint> points, const Vec3& start) {
  Vec3 farthest = start;
  Ball best = ball_around(start, points, farthest);
  Vec3 centre = start;
  for (int round = 1; round <= kBallRounds; ++round) {
    centre += (farthest - centre) / (round + 1);
    const Ball ball = ball_around(centre, points, farthest);
    if (ball.radius_m < best.radius_m) best = ball;
  }
  return best;
}

/// Returns `mean` if the points are on a plane, else the point nearest to `mean`. The mean of points on a curved
/// surface is not on the surface. For example, the mean of the points on the rim of a hole is inside the hole. It would
/// press on a peg in the hole that does not touch the rim.
Eigen::Vector3f on_surface(std::span<const ShellPoint> points, const Vec3& mean, const Vec3& normal) {
  double bulge_m = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  const ShellPoint* nearest = &points.front();
  for (const ShellPoint& point : points) {
    const Vec3 off = point.p_S.cast<double>() - mean;
    bulge_m = std::max(bulge_m, std::abs(normal.dot(off)));
    if (off.norm() >= nearest_m) continue;
    nearest_m = off.norm();
    nearest = &point;
  }
  return bulge_m > kFlatBulge_m ? nearest->p_S : Eigen::Vector3f(mean.cast<float>());
}

ShellPoint merged(std::span<const ShellPoint> points) {
  double area = 0;
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  for (const ShellPoint& point : points) {
    area += point.area_m2;
    position += point.area_m2 * point.p_S.cast<double>();
    normal += point.area_m2 * point.normal_S.cast<double>();
  }
  if (!(area > 0)) return points.front();
  // If the points' normals cancel out, their mean has no direction. The normal of the first point is used instead.
  const bool has_direction = normal.norm() > 1e-6 * area;
  const Eigen::Vector3f direction =
      has_direction ? Eigen::Vector3f(normal.normalized().cast<float>()) : points.front().normal_S;
  return {on_surface(points, position / area, direction.cast<double>()), direction, static_cast<float>(area)};
}

/// Builds the tree by halving the points in memory order. If a node contains borders of flat parts of the surface, it
/// is divided at one of these borders instead.
class TreeBuilder {
 public:
  explicit TreeBuilder(PointShell& shell) : shell_(shell), borders_(borders_of_parts(shell.points)) {}

  void build(std::uint32_t first, std::uint32_t count) {
    const std::size_t at = shell_.nodes.size();
    const auto points = std::span(shell_.points).subspan(first, count);
    Vec3 low = points.front().p_S.cast<double>();
    Vec3 high = low;
    for (const ShellPoint& point : points) {
      low = low.cwiseMin(point.p_S.cast<double>());
      high = high.cwiseMax(point.p_S.cast<double>());
    }
    shell_.nodes.push_back(node_of(points, first, (low + high) / 2));
    if (count > kShellLeafPoints) {
      const std::uint32_t middle = middle_of(first, count);
      build(first, middle - first);
      build(middle, first + count - middle);
    }
    shell_.nodes[at].next = static_cast<std::uint32_t>(shell_.nodes.size());
  }

 private:
  static ShellNode node_of(std::span<const ShellPoint> points, std::uint32_t first, const Vec3& middle) {
    const Ball ball = small_ball(points, middle);
    ShellNode node;
    node.centre_S = ball.centre.cast<float>();
    // The radius is enlarged by the rounding error of the centre in single precision.
    const double rounding = (node.centre_S.cast<double>() - ball.centre).norm();
    node.radius_m = std::nextafter(static_cast<float>((ball.radius_m + rounding) * (1 + 1e-6)),
                                   std::numeric_limits<float>::infinity());
    node.first = first;
    node.count = static_cast<std::uint32_t>(points.size());
    node.is_leaf = node.count <= kShellLeafPoints;
    node.mean = merged(points);
    return node;
  }

  // Returns the index of the first point of a node's second half. If the node contains borders of flat parts, it is the
  // border nearest to the middle, else the middle.
  std::uint32_t middle_of(std::uint32_t first, std::uint32_t count) const {
    const std::uint32_t half = first + count / 2;
    const auto above = std::ranges::lower_bound(borders_, half);
    std::uint32_t middle = half, farthest = count;
    const auto try_border = [&](std::uint32_t border) {
      const std::uint32_t off = border > half ? border - half : half - border;
      if (border <= first || border >= first + count || off >= farthest) return;
      farthest = off;
      middle = border;
    };
    if (above != borders_.begin()) try_border(*std::prev(above));
    if (above != borders_.end()) try_border(*above);
    return middle;
  }

  PointShell& shell_;
  std::vector<std::uint32_t> borders_;
};

}  // namespace

PointShell PointShell::make(std::vector<ShellPoint> points, double spacing_m) {
  order_by_parts(points);
  return in_order(std::move(points), spacing_m);
}

PointShell PointShell::in_order(std::vector<ShellPoint> points, double spacing_m) {
  PointShell shell;
  shell.spacing_m = spacing_m;
  shell.points = std::move(points);
  if (shell.points.empty()) return shell;
  shell.nodes.reserve(shell.points.size() / 2);
  TreeBuilder(shell).build(0, static_cast<std::uint32_t>(shell.points.size()));
  shell.nodes.shrink_to_fit();
  shell.flat_nodes = find_flat_nodes(shell.points, shell.nodes);
  return shell;
}

double PointShell::area_m2() const {
  double sum = 0;
  for (const ShellPoint& point : points) sum += point.area_m2;
  return sum;
}

std::size_t PointShell::memory_bytes() const {
  return sizeof(*this) + points.capacity() * sizeof(ShellPoint) + nodes.capacity() * sizeof(ShellNode) +
         flat_nodes.capacity() * sizeof(FlatNode);
}

}  // namespace tandem::contact
