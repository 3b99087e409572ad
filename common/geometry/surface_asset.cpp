#include "common/geometry/surface_asset.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/base/byte_io.hpp"
#include "common/base/progress.hpp"

namespace tandem::geometry {
namespace {

constexpr std::uint32_t kSurfaceMagic = 0x46525354;  // first four bytes of each asset: "TSRF"
constexpr std::size_t kVertexBytes = 3 * sizeof(float);
constexpr std::size_t kTriangleBytes = 3 * sizeof(std::uint32_t);

/// Returns the reason why a mesh cannot be encoded; empty if it can.
std::string problem_of(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return "it has no triangle";
  if (mesh.triangles.size() > kMaxSurfaceTriangles || mesh.vertices.size() > kMaxSurfaceVertices) {
    return "it has " + std::to_string(mesh.triangles.size()) + " triangles and " +
           std::to_string(mesh.vertices.size()) + " vertices; at most " + std::to_string(kMaxSurfaceTriangles) +
           " of each may be sent";
  }
  const auto is_near = [](const Vec3& p) { return is_finite(p) && p.cwiseAbs().maxCoeff() <= kMaxSurfaceReach_m; };
  if (!std::all_of(mesh.vertices.begin(), mesh.vertices.end(), is_near)) {
    return "a vertex is not finite, or farther than a kilometre from the origin";
  }
  const auto is_vertex = [&](int index) {
    return index >= 0 && static_cast<std::size_t>(index) < mesh.vertices.size();
  };
  for (const auto& triangle : mesh.triangles) {
    if (!std::all_of(triangle.begin(), triangle.end(), is_vertex)) return "a triangle names a vertex that is not there";
  }
  return {};
}

std::array<int, 3> read_triangle(ByteReader& reader) {
  std::array<std::uint32_t, 3> corners{};
  reader.array(std::span<std::uint32_t>(corners));
  // An index beyond the limit becomes −1, which is always out of range. A plain conversion to int could yield a valid
  // index.
  std::array<int, 3> triangle{};
  std::transform(corners.begin(), corners.end(), triangle.begin(),
                 [](std::uint32_t index) { return index < kMaxSurfaceVertices ? static_cast<int>(index) : -1; });
  return triangle;
}

}  // namespace

std::vector<std::byte> surface_asset_bytes(const TriangleMesh& mesh) {
  if (const std::string problem = problem_of(mesh); !problem.empty()) {
    throw std::invalid_argument("a surface cannot be made an asset: " + problem);
  }
  std::vector<std::uint8_t> octets = begin_asset(kSurfaceMagic, kSurfaceAssetVersion);
  octets.reserve(24 + mesh.vertices.size() * kVertexBytes + mesh.triangles.size() * kTriangleBytes);
  ByteWriter writer(octets);
  writer.u32(static_cast<std::uint32_t>(mesh.vertices.size()));
  writer.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Vec3& vertex : mesh.vertices) {
    for (const double coordinate : vertex) writer.f32(static_cast<float>(coordinate));
  }
  for (const auto& triangle : mesh.triangles) {
    for (const int index : triangle) writer.u32(static_cast<std::uint32_t>(index));
  }
  end_asset(octets);
  return bytes_of(octets);
}

std::optional<TriangleMesh> surface_from(std::span<const std::byte> bytes) {
  auto content = asset_content(octets_of(bytes), kSurfaceMagic, kSurfaceAssetVersion);
  if (!content) return std::nullopt;
  ByteReader reader(*content);
  const std::size_t vertices = reader.u32(), triangles = reader.u32();
  if (!reader.ok() || vertices > kMaxSurfaceVertices || triangles > kMaxSurfaceTriangles) return std::nullopt;
  // Both counts are bounded, so the products cannot overflow.
  if (content->size() != vertices * kVertexBytes + triangles * kTriangleBytes) return std::nullopt;
  TriangleMesh mesh;
  mesh.vertices.reserve(vertices);
  mesh.triangles.reserve(triangles);
  for (std::size_t i = 0; i < vertices; ++i) {
    call_off_point(i);
    const float x = reader.f32(), y = reader.f32(), z = reader.f32();
    mesh.vertices.emplace_back(x, y, z);
  }
  for (std::size_t i = 0; i < triangles; ++i) mesh.triangles.push_back(read_triangle(reader));
  if (!problem_of(mesh).empty()) return std::nullopt;
  return mesh;
}

}  // namespace tandem::geometry
