#include "common/geometry/repair/mesh_bounds.hpp"

#include <sstream>
#include <string>

#include "common/geometry/mesh_repair.hpp"

namespace tandem::geometry {
namespace {

std::string text_of(const Vec3& p) {
  std::ostringstream text;
  text << '(' << p.x() << ", " << p.y() << ", " << p.z() << ')';
  return text.str();
}

}  // namespace

Eigen::AlignedBox3d mesh_bounds(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      const Vec3& vertex = mesh.vertices[static_cast<std::size_t>(corner)];
      // A comparison with NaN is false, so the condition also refuses a vertex with NaN.
      if (vertex.cwiseAbs().maxCoeff() <= kMaxMeshUnits && vertex.allFinite()) {
        box.extend(vertex);
        continue;
      }
      throw MeshError("its vertex " + std::to_string(corner) + " is at " + text_of(vertex) +
                      "; coordinates must be finite and at most 1e100: the file is damaged, export it again");
    }
  }
  if (mesh.triangles.empty()) throw MeshError("it has no triangle: export its surface as triangles");
  if (const double size = box.sizes().maxCoeff(); size < 1 / kMaxMeshUnits) {
    throw MeshError("all its vertices are at one place, " + text_of(box.min()) +
                    ": it has no size to scale by; give the mesh of a surface");
  }
  return box;
}

}  // namespace tandem::geometry
