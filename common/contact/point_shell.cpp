#include "common/contact/point_shell.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "common/base/byte_io.hpp"

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
  explicit TreeBuilder(PointShell& shell) : shell_(shell) {}

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
      int axis = 0;
      (high - low).maxCoeff(&axis);
      const auto middle = points.begin() + count / 2;
      std::nth_element(points.begin(), middle, points.end(),
                       [axis](const ShellPoint& a, const ShellPoint& b) { return a.p_S[axis] < b.p_S[axis]; });
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

  PointShell& shell_;
};

constexpr std::size_t kPointFloats = 7;
constexpr std::size_t kNodeFloats = 4 + kPointFloats;
constexpr std::size_t kNodeBytes = 4 * (kNodeFloats + 3) + 1;
constexpr float kMaxCoordinate = 1e4F;

void put_point(const ShellPoint& point, float* out) {
  for (int axis = 0; axis < 3; ++axis) {
    out[axis] = point.p_S[axis];
    out[3 + axis] = point.normal_S[axis];
  }
  out[6] = point.area_m2;
}

ShellPoint point_from(const float* in) {
  return {Eigen::Vector3f(in[0], in[1], in[2]), Eigen::Vector3f(in[3], in[4], in[5]), in[6]};
}

bool is_plausible(const ShellPoint& point) {
  return point.p_S.allFinite() && point.p_S.cwiseAbs().maxCoeff() < kMaxCoordinate &&
         std::abs(point.normal_S.squaredNorm() - 1) < 1e-3F && point.area_m2 >= 0 && point.area_m2 < 1e8F;
}

bool is_plausible(const ShellNode& node) {
  return node.centre_S.allFinite() && node.centre_S.cwiseAbs().maxCoeff() < kMaxCoordinate && node.radius_m >= 0 &&
         node.radius_m < 4 * kMaxCoordinate && is_plausible(node.mean);
}

/// Whether the nodes are a tree over exactly the points, in depth-first order: each leaf small, each other node split
/// into two.
bool is_tree(const std::vector<ShellNode>& nodes, std::size_t point_count) {
  if (nodes.empty() || point_count == 0) return nodes.empty() && point_count == 0;
  if (nodes[0].first != 0 || nodes[0].count != point_count || nodes[0].next != nodes.size()) return false;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const ShellNode& node = nodes[i];
    if (node.is_leaf) {
      if (node.next != i + 1 || node.count == 0 || node.count > kShellLeafPoints) return false;
      continue;
    }
    // The parents' checks have put `next` within the nodes.
    if (node.next < i + 3) return false;
    const ShellNode& left = nodes[i + 1];
    if (left.next < i + 2 || left.next >= node.next) return false;
    const ShellNode& right = nodes[left.next];
    const bool is_split = left.first == node.first && left.count < node.count &&
                          right.first == left.first + left.count && right.count == node.count - left.count;
    if (!is_split || right.next != node.next) return false;
  }
  return true;
}

}  // namespace

PointShell PointShell::of(std::vector<ShellPoint> points, double spacing_m) {
  PointShell shell;
  shell.spacing_m = spacing_m;
  shell.points = std::move(points);
  if (shell.points.empty()) return shell;
  shell.nodes.reserve(shell.points.size() / 2);
  TreeBuilder(shell).build(0, static_cast<std::uint32_t>(shell.points.size()));
  shell.nodes.shrink_to_fit();
  return shell;
}

double PointShell::area_m2() const {
  double sum = 0;
  for (const ShellPoint& point : points) sum += point.area_m2;
  return sum;
}

std::size_t PointShell::memory_bytes() const {
  return sizeof(*this) + points.capacity() * sizeof(ShellPoint) + nodes.capacity() * sizeof(ShellNode);
}

void PointShell::write(std::vector<std::uint8_t>& bytes) const {
  ByteWriter writer(bytes);
  writer.f64(spacing_m);
  writer.u32(static_cast<std::uint32_t>(points.size()));
  std::vector<float> numbers(points.size() * kPointFloats);
  for (std::size_t i = 0; i < points.size(); ++i) put_point(points[i], numbers.data() + i * kPointFloats);
  writer.array(std::span<const float>(numbers));
  writer.u32(static_cast<std::uint32_t>(nodes.size()));
  for (const ShellNode& node : nodes) {
    std::array<float, kNodeFloats> fields = {node.centre_S.x(), node.centre_S.y(), node.centre_S.z(), node.radius_m};
    put_point(node.mean, fields.data() + 4);
    writer.array(std::span<const float>(fields));
    writer.array(std::span<const std::uint32_t>(std::array{node.first, node.count, node.next}));
    writer.number(static_cast<std::uint8_t>(node.is_leaf ? 1 : 0));
  }
}

std::optional<PointShell> PointShell::read(std::span<const std::uint8_t>& bytes) {
  ByteReader reader(bytes);
  PointShell shell;
  shell.spacing_m = reader.f64();
  if (!std::isfinite(shell.spacing_m) || shell.spacing_m < 0 || shell.spacing_m > kMaxCoordinate) return {};
  std::vector<float> numbers(reader.count(4 * kPointFloats) * kPointFloats);
  reader.array(std::span(numbers));
  shell.points.reserve(numbers.size() / kPointFloats);
  for (std::size_t i = 0; i < numbers.size(); i += kPointFloats) shell.points.push_back(point_from(&numbers[i]));
  shell.nodes.resize(reader.count(kNodeBytes));
  for (ShellNode& node : shell.nodes) {
    std::array<float, kNodeFloats> fields{};
    std::array<std::uint32_t, 3> indices{};
    reader.array(std::span<float>(fields));
    reader.array(std::span<std::uint32_t>(indices));
    node.centre_S = Eigen::Vector3f(fields[0], fields[1], fields[2]);
    node.radius_m = fields[3];
    node.mean = point_from(fields.data() + 4);
    node.first = indices[0];
    node.count = indices[1];
    node.next = indices[2];
    node.is_leaf = reader.number<std::uint8_t>() != 0;
  }
  const auto plausible = [](const auto& item) { return is_plausible(item); };
  const bool is_whole = reader.ok() && std::all_of(shell.points.begin(), shell.points.end(), plausible) &&
                        std::all_of(shell.nodes.begin(), shell.nodes.end(), plausible) &&
                        is_tree(shell.nodes, shell.points.size());
  if (!is_whole) return {};
  return shell;
}

}  // namespace tandem::contact
