// Prepares arbitrary vertices and triangles for contact, as a user's mesh. The mesh must be refused, or its surfaces
// must be valid and unchanged when they are written and read again. The parser of mesh files is a separate program with
// bounded memory and time, and is not tested here.
#include <cmath>
#include <cstdint>
#include <span>

#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/surface_asset.hpp"
#include "tests/fuzz/check.hpp"

namespace {

using namespace tandem;
using fuzz::check;

void check(const geometry::TriangleMesh& mesh) {
  const auto count = static_cast<int>(mesh.vertices.size());
  for (const Vec3& vertex : mesh.vertices) check(vertex.allFinite());
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) check(corner >= 0 && corner < count);
    check(triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0]);
  }
}

/// Builds a mesh from bytes.
/// Model   layout of the bytes: exponent of 2 that gives the unit; number of vertices; x, y and z of each vertex as signed
///         bytes; vertex indices of the triangles
geometry::TriangleMesh mesh_of(std::span<const std::uint8_t> bytes) {
  geometry::TriangleMesh mesh;
  if (bytes.size() < 2) return mesh;
  const double unit_m = std::ldexp(1.0, static_cast<std::int8_t>(bytes[0]));
  const std::size_t count = bytes[1];
  bytes = bytes.subspan(2);
  for (; mesh.vertices.size() < count && bytes.size() >= 3; bytes = bytes.subspan(3)) {
    const auto at = [&bytes](std::size_t i) { return static_cast<double>(static_cast<std::int8_t>(bytes[i])); };
    mesh.vertices.emplace_back(unit_m * Vec3(at(0), at(1), at(2)));
  }
  for (; bytes.size() >= 3; bytes = bytes.subspan(3)) mesh.triangles.push_back({bytes[0], bytes[1], bytes[2]});
  return mesh;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const geometry::ContactMesh made = geometry::repaired(mesh_of({data, size}));
    const geometry::TriangleMesh all = geometry::all_of(made);
    check(made.mesh);
    check(made.sheet);
    check(!all.triangles.empty());
    geometry::part_lines(made);
    const auto again = geometry::surface_from(geometry::surface_asset_bytes(all));
    check(again.has_value() && again->triangles == all.triangles);
  } catch (const geometry::MeshError&) {
  } catch (const std::invalid_argument&) {  // the mesh is too far from the origin for single precision
  }
  return 0;
}
