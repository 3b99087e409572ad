#include "lab/studies/contact/proxy_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "lab/studies/contact/mesh_generators.hpp"

namespace tandem::lab {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kPressed_m = 5e-3;
constexpr double kHandSpeed_m_per_s = 0.2;
/// Size of the ellipsoid on which the target point moves, as a multiple of the bounding box of the mesh.
constexpr double kWiden = 1.3;
/// Periods of the target point's motion in azimuth and elevation, and its largest elevation. The ratio of the periods
/// is chosen so that the path rarely repeats.
constexpr double kRound_s = 7;
constexpr double kUpAndDown_s = 3.1;
constexpr double kElevation_rad = 1.2;
/// lag_of() evaluates every kLagStride-th tick; the stride is not a divisor of a period of the path. An evaluation runs
/// at most kMaxSettling updates until the proxy is at rest.
constexpr std::size_t kLagStride = 7;
constexpr int kMaxSettling = 200;
/// Motion per update below which the proxy counts as resting.
constexpr double kAtRest_m = 1e-7;

/// Returns six times the signed volume of a tetrahedron.
double volume6(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

/// Returns whether the segment pq crosses the triangle. A segment that ends on the triangle or touches its edge counts
/// as crossing.
bool crosses_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  if (volume6(a, b, c, p) * volume6(a, b, c, q) > 0) return false;
  const double ab = volume6(p, q, a, b);
  const double bc = volume6(p, q, b, c);
  const double ca = volume6(p, q, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

double lowest_x(const std::array<Vec3, 3>& triangle) {
  return std::min({triangle[0].x(), triangle[1].x(), triangle[2].x()});
}

/// Tests whether straight segments cross a mesh. All triangles that overlap the segment's extent in x are tested.
class CrossingTest {
 public:
  explicit CrossingTest(const geometry::TriangleMesh& mesh);
  bool crosses(const Vec3& from, const Vec3& to) const;

 private:
  std::vector<std::array<Vec3, 3>> triangles_;  ///< triangles, sorted by their lowest x
  double widest_m_ = 0;                         ///< largest extent of a triangle along x
};

CrossingTest::CrossingTest(const geometry::TriangleMesh& mesh) {
  triangles_.reserve(mesh.triangles.size());
  for (const auto& corners : mesh.triangles) {
    const auto corner = [&](std::size_t i) { return mesh.vertices[static_cast<std::size_t>(corners[i])]; };
    const auto [low, high] = std::minmax({corner(0).x(), corner(1).x(), corner(2).x()});
    widest_m_ = std::max(widest_m_, high - low);
    triangles_.push_back({corner(0), corner(1), corner(2)});
  }
  std::ranges::sort(triangles_, {}, lowest_x);
}

bool CrossingTest::crosses(const Vec3& from, const Vec3& to) const {
  if (from == to) return false;
  const auto [low, high] = std::minmax(from.x(), to.x());
  auto triangle = std::ranges::lower_bound(triangles_, low - widest_m_, {}, lowest_x);
  for (; triangle != triangles_.end() && lowest_x(*triangle) <= high; ++triangle) {
    const auto& [a, b, c] = *triangle;
    if (crosses_triangle(from, to, a, b, c)) return true;
  }
  return false;
}

}  // namespace

std::vector<Vec3> wandering_hand(const geometry::TriangleMesh& mesh, std::size_t steps) {
  const geometry::TriangleTree tree(mesh);
  const Eigen::AlignedBox3d bounds = bounds_of(mesh);
  const Vec3 centre = (bounds.min() + bounds.max()) / 2;
  const Vec3 half = kWiden * (bounds.max() - bounds.min()) / 2;
  const double margin_m = 2 * kPressed_m;
  std::vector<Vec3> hand;
  hand.reserve(steps);
  for (std::size_t i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) * kTick_s;
    const double azimuth = 2 * std::numbers::pi * t / kRound_s;
    const double elevation = kElevation_rad * std::sin(2 * std::numbers::pi * t / kUpAndDown_s);
    const Vec3 direction(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation));
    const Vec3 y = centre + (half + Vec3::Constant(margin_m)).cwiseProduct(direction);
    if (i == 0) {
      hand.push_back(y);
      continue;
    }
    const Vec3 closest = tree.closest(y).point_S;
    const Vec3 drawn_to = closest + kPressed_m * (closest - y).stableNormalized();
    hand.push_back(hand.back() + clamped_to_length(drawn_to - hand.back(), kHandSpeed_m_per_s * kTick_s));
  }
  return hand;
}

ProxyRun run_god_object(const std::shared_ptr<const haptics::ProxyMesh>& mesh,
                        const haptics::GodObjectSettings& settings, const std::vector<Vec3>& hand, const Clock& clock) {
  haptics::ProxyObstacle obstacle;
  obstacle.mesh = mesh;
  haptics::GodObject proxy(settings, {obstacle}, hand.front());
  ProxyRun run;
  run.times.reserve(hand.size());
  run.ball_W.reserve(hand.size());
  for (const Vec3& goal : hand) {
    const LocalTime begin = clock.now();
    const haptics::ProxyState& state = proxy.update(goal);
    run.times.push_back(clock.now() - begin);
    run.ball_W.push_back(state.p_W);
    run.way_W.insert(run.way_W.end(), proxy.way_W().begin(), proxy.way_W().end());
  }
  return run;
}

ProxyRun run_closest_point(const geometry::TriangleTree& tree, double radius_m, const std::vector<Vec3>& hand,
                           const Clock& clock) {
  ProxyRun run;
  run.times.reserve(hand.size());
  run.way_W.reserve(hand.size());
  for (const Vec3& goal : hand) {
    const LocalTime begin = clock.now();
    const geometry::TriangleTree::Closest closest = tree.closest(goal);
    const Vec3 normal = closest.normal_S.stableNormalized();
    const bool is_touching = (goal - closest.point_S).dot(normal) < radius_m;
    const Vec3 touch = is_touching ? Vec3(closest.point_S + radius_m * normal) : goal;
    run.times.push_back(clock.now() - begin);
    run.way_W.push_back(touch);
  }
  run.ball_W = run.way_W;
  return run;
}

ProxyFigures figures_of(const std::vector<ProxyRun>& runs, const geometry::TriangleMesh& mesh, double radius_m) {
  const geometry::TriangleTree tree(mesh);
  const CrossingTest crossing_test(mesh);
  ProxyFigures figures;
  std::vector<Duration> times;
  for (const ProxyRun& run : runs) times.insert(times.end(), run.times.begin(), run.times.end());
  figures.loop_us = quantiles_of(std::move(times));
  for (const Vec3& p : runs.front().ball_W) {
    figures.max_penetration_m = std::max(figures.max_penetration_m, radius_m - tree.signed_distance_m(p));
  }
  const std::vector<Vec3>& way = runs.front().way_W;
  for (std::size_t i = 1; i < way.size(); ++i)
    figures.pop_throughs += crossing_test.crosses(way[i - 1], way[i]) ? 1 : 0;
  return figures;
}

ProxyLag lag_of(const std::shared_ptr<const haptics::ProxyMesh>& mesh, const haptics::GodObjectSettings& settings,
                const std::vector<Vec3>& hand) {
  haptics::ProxyObstacle obstacle;
  obstacle.mesh = mesh;
  haptics::GodObject proxy(settings, {obstacle}, hand.front());
  haptics::GodObject waiting = proxy;
  std::size_t held_back = 0;
  std::vector<double> lags_m;
  for (std::size_t i = 0; i < hand.size(); ++i) {
    const haptics::ProxyState& state = proxy.update(hand[i]);
    held_back += (state.faults & haptics::kProxyHeldBack) != 0 ? 1 : 0;
    if (i % kLagStride != 0) continue;
    waiting = proxy;
    for (int more = 0; more < kMaxSettling; ++more) {
      const Vec3 before_W = waiting.state().p_W;
      if ((waiting.update(hand[i]).p_W - before_W).norm() < kAtRest_m) break;
    }
    lags_m.push_back((waiting.state().p_W - state.p_W).norm());
  }
  std::sort(lags_m.begin(), lags_m.end());
  const auto at = [&](double q) {
    return lags_m[static_cast<std::size_t>(q * static_cast<double>(lags_m.size() - 1))];
  };
  return {static_cast<double>(held_back) / static_cast<double>(hand.size()), at(0.5), at(0.99), at(1)};
}

double depth_of(const std::vector<Vec3>& hand, const geometry::TriangleTree& tree) {
  double deepest_m = 0;
  for (const Vec3& p : hand) deepest_m = std::max(deepest_m, -tree.signed_distance_m(p));
  return deepest_m;
}

boost::json::object to_json(const ProxyLag& lag) {
  return {{"held_back_share", lag.held_back_share},
          {"lag_m", boost::json::object{{"p50", lag.p50_m}, {"p99", lag.p99_m}, {"max", lag.max_m}}}};
}

boost::json::object to_json(const ProxyFigures& figures) {
  return {{"loop_us", to_json(figures.loop_us)},
          {"max_penetration_m", figures.max_penetration_m},
          {"pop_throughs", figures.pop_throughs}};
}

}  // namespace tandem::lab
