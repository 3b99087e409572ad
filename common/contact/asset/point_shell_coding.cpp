// Writes and reads a point shell. Each point is coded as its difference from the previous point, in whole steps. The
// tree is not written, because the order of the points determines it.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "common/base/progress.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/geometry/packing.hpp"

namespace tandem::contact {
namespace {

constexpr double kMaxCoordinate = 1e4;
constexpr double kMaxArea_m2 = 1e8;
// Resolution of positions and areas: number of steps in one point spacing, and in the square of the spacing.
constexpr double kPlaceSteps = 256;
constexpr double kAreaSteps = 1024;
// Resolution of normals. A direction is mapped to an octahedron, which is unfolded to a square. This is the number of
// steps along half a side of the square. The directions of neighbouring steps differ by at most 1/11 of a degree.
constexpr int kNormalSteps = 1024;
constexpr std::size_t kNumbers = 6;

/// One point in whole steps: three numbers for the position, two for the normal, one for the area.
using Steps = std::array<std::int32_t, kNumbers>;

std::array<std::int32_t, 2> steps_of(const Eigen::Vector3f& normal) {
  const Eigen::Vector2d at = geometry::in_square(normal.cast<double>());
  const auto step = [](double share) { return static_cast<std::int32_t>(std::lround(share * kNormalSteps)); };
  std::int32_t u = step(at.x()), v = step(at.y());
  // On the border of the unfolded octahedron, two positions represent the same direction. One of the two is chosen.
  if (std::abs(u) == kNormalSteps) v = std::abs(v);
  if (std::abs(v) == kNormalSteps) u = std::abs(u);
  return {u, v};
}

Eigen::Vector3f normal_of(std::int32_t u, std::int32_t v) {
  return geometry::direction_of(static_cast<double>(u) / kNormalSteps, static_cast<double>(v) / kNormalSteps)
      .cast<float>();
}

/// Converts a sequence of points to steps. The rounding error of each area is added to the next point's area, so that
/// the total area does not change.
class Coder {
 public:
  explicit Coder(double spacing_m) : place_m_(spacing_m / kPlaceSteps), area_m2_(spacing_m * spacing_m / kAreaSteps) {}

  Steps steps(const ShellPoint& point) {
    Steps steps{};
    for (int axis = 0; axis < 3; ++axis) {
      steps[static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::lround(static_cast<double>(point.p_S[axis]) / place_m_));
    }
    const auto [u, v] = steps_of(point.normal_S);
    steps[3] = u;
    steps[4] = v;
    const double area = static_cast<double>(point.area_m2) / area_m2_ + carried_;
    // The area is at least one step, because a point without area would have no force.
    steps[5] = std::max(1, static_cast<std::int32_t>(std::lround(area)));
    carried_ = std::clamp(area - steps[5], -1.0, 1.0);
    return steps;
  }

  std::optional<ShellPoint> point(const Steps& steps) const {
    const Vec3 p = place_m_ * Vec3(steps[0], steps[1], steps[2]);
    const double area_m2 = area_m2_ * steps[5];
    const bool is_normal = std::abs(steps[3]) <= kNormalSteps && std::abs(steps[4]) <= kNormalSteps;
    if (!is_normal || !(p.cwiseAbs().maxCoeff() < kMaxCoordinate) || steps[5] < 1 || !(area_m2 < kMaxArea_m2))
      return {};
    return ShellPoint{p.cast<float>(), normal_of(steps[3], steps[4]), static_cast<float>(area_m2)};
  }

 private:
  double place_m_;
  double area_m2_;
  double carried_ = 0;
};

/// Adds `more` to `value`. Returns false if the sum is out of range.
bool add(std::int32_t& value, std::int32_t more) {
  return !__builtin_add_overflow(value, more, &value);
}

}  // namespace

void PointShell::write(std::vector<std::uint8_t>& bytes, int packing_level) const {
  ByteWriter(bytes).f64(spacing_m);
  ByteWriter(bytes).u32(static_cast<std::uint32_t>(points.size()));
  std::array<std::vector<std::int32_t>, kNumbers> columns;
  Coder coder(spacing_m);
  Steps before{};
  for (const ShellPoint& point : points) {
    const Steps steps = coder.steps(point);
    for (std::size_t i = 0; i < kNumbers; ++i) columns[i].push_back(steps[i] - before[i]);
    before = steps;
  }
  for (const std::vector<std::int32_t>& column : columns)
    geometry::append_block(bytes, geometry::planes_of(column), packing_level);
}

std::optional<PointShell> PointShell::read(std::span<const std::uint8_t>& bytes, std::size_t limit_bytes) {
  ByteReader reader(bytes);
  const double spacing_m = reader.f64();
  const std::size_t count = reader.u32();
  const bool is_sound = reader.ok() && spacing_m >= 0 && spacing_m < kMaxCoordinate && (spacing_m > 1e-9 || count == 0);
  if (!is_sound || count > limit_bytes / sizeof(ShellPoint)) return {};
  std::array<std::vector<std::int32_t>, kNumbers> columns;
  for (std::vector<std::int32_t>& column : columns) {
    call_off_point();
    const auto block = geometry::read_block(reader, 4 * count);
    if (!block || block->size() != 4 * count) return {};
    column = geometry::values_of(*block);
  }
  const Coder coder(spacing_m);
  std::vector<ShellPoint> points;
  points.reserve(count);
  Steps steps{};
  for (std::size_t at = 0; at < count; ++at) {
    call_off_point(at);
    for (std::size_t i = 0; i < kNumbers; ++i) {
      if (!add(steps[i], columns[i][at])) return {};
    }
    const auto point = coder.point(steps);
    if (!point) return {};
    points.push_back(*point);
  }
  return in_order(std::move(points), spacing_m);
}

}  // namespace tandem::contact
