#include "common/geometry/mesh_sides.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

// Of more triangles than so many, they are shared among the processors.
constexpr std::size_t kMinForThreads = 5000;
constexpr std::size_t kMaxThreads = 16;

/// A triangle itself makes the winding number jump by 1. Half way, which is what the others make there, it is ½ where a
/// solid is on one side, 0 where none is, and 1 or more inside of one; of a solid that is inside out less than 0.
Side side_of(double half_way) {
  const double others = std::abs(half_way);
  if (others < 0.25) return Side::kOutside;
  return others < 0.75 ? Side::kBorder : Side::kInside;
}

Side side_of(const WindingNumber& winding, const TriangleMesh& mesh, std::size_t triangle) {
  Vec3 middle = Vec3::Zero();
  for (const int corner : mesh.triangles[triangle]) middle += mesh.vertices[static_cast<std::size_t>(corner)] / 3;
  return side_of(winding.at(middle, static_cast<int>(triangle)));
}

}  // namespace

std::vector<Side> sides_of(const TriangleMesh& mesh) {
  const WindingNumber winding(mesh);
  std::vector<Side> sides(mesh.triangles.size());
  const auto decide = [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) sides[t] = side_of(winding, mesh, t);
  };
  const std::size_t processors = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads = sides.size() < kMinForThreads ? 1 : std::min(processors, kMaxThreads);
  std::vector<std::jthread> helpers;
  for (std::size_t i = 1; i < threads; ++i) {
    helpers.emplace_back(decide, sides.size() * i / threads, sides.size() * (i + 1) / threads);
  }
  decide(0, sides.size() / threads);
  helpers.clear();
  return sides;
}

}  // namespace tandem::geometry
