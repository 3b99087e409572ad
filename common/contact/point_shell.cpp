#include "common/contact/point_shell.hpp"

#include <algorithm>
#include <limits>

namespace tandem::contact {
namespace {

// Where a ball is moved to the point farthest from its centre, by 1/2, 1/3, …: the radius is then within a few per cent
// of the smallest (Bădoiu & Clarkson, "Smaller core-sets for balls", 2003).
constexpr int kBallRounds = 8;
// Points that lie this near to a plane are as good as their mean.
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

/// `mean` where the points are flat. Where they are not it is off the surface: around the edge of a hole it is in the
/// air, and would press on a peg that does not touch. There it is the point nearest to it.
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
  // Of points that face all ways, the first speaks for all.
  const bool has_direction = normal.norm() > 1e-6 * area;
  const Eigen::Vector3f direction =
      has_direction ? Eigen::Vector3f(normal.normalized().cast<float>()) : points.front().normal_S;
  return {on_surface(points, position / area, direction.cast<double>()), direction, static_cast<float>(area)};
}

class TreeBuilder {
 public:
  TreeBuilder(PointShell& shell, bool is_in_order) : shell_(shell), is_in_order_(is_in_order) {}

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
      if (!is_in_order_) split(points, high - low);
      build(first, count / 2);
      build(first + count / 2, count - count / 2);
    }
    shell_.nodes[at].next = static_cast<std::uint32_t>(shell_.nodes.size());
  }

 private:
  static ShellNode node_of(std::span<const ShellPoint> points, std::uint32_t first, const Vec3& middle) {
    const Ball ball = small_ball(points, middle);
    ShellNode node;
    node.centre_S = ball.centre.cast<float>();
    // The centre is rounded to single precision: every point is still inside.
    const double rounding = (node.centre_S.cast<double>() - ball.centre).norm();
    node.radius_m = std::nextafter(static_cast<float>((ball.radius_m + rounding) * (1 + 1e-6)),
                                   std::numeric_limits<float>::infinity());
    node.first = first;
    node.count = static_cast<std::uint32_t>(points.size());
    node.is_leaf = node.count <= kShellLeafPoints;
    node.mean = merged(points);
    return node;
  }

  static void split(std::span<ShellPoint> points, const Vec3& size) {
    int axis = 0;
    size.maxCoeff(&axis);
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(),
                     [axis](const ShellPoint& a, const ShellPoint& b) { return a.p_S[axis] < b.p_S[axis]; });
  }

  PointShell& shell_;
  bool is_in_order_;
};

PointShell with_tree(std::vector<ShellPoint> points, double spacing_m, bool is_in_order) {
  PointShell shell;
  shell.spacing_m = spacing_m;
  shell.points = std::move(points);
  if (shell.points.empty()) return shell;
  shell.nodes.reserve(shell.points.size() / 2);
  TreeBuilder(shell, is_in_order).build(0, static_cast<std::uint32_t>(shell.points.size()));
  shell.nodes.shrink_to_fit();
  return shell;
}

}  // namespace

PointShell PointShell::of(std::vector<ShellPoint> points, double spacing_m) {
  return with_tree(std::move(points), spacing_m, false);
}

PointShell PointShell::in_order(std::vector<ShellPoint> points, double spacing_m) {
  return with_tree(std::move(points), spacing_m, true);
}

double PointShell::area_m2() const {
  double sum = 0;
  for (const ShellPoint& point : points) sum += point.area_m2;
  return sum;
}

std::size_t PointShell::memory_bytes() const {
  return sizeof(*this) + points.capacity() * sizeof(ShellPoint) + nodes.capacity() * sizeof(ShellNode);
}

}  // namespace tandem::contact
