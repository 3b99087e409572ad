#include "server/assets/meshes/polygons.hpp"

#include <algorithm>
#include <sstream>

#include "server/assets/mesh_reader.hpp"

namespace tandem::server::mesh_reader {
namespace {

std::string short_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void check_count(const Polygons& mesh) {
  if (mesh.face_sizes.size() <= kMaxTriangles && mesh.vertices.size() <= kMaxVertices) return;
  throw Refusal("which has " + std::to_string(mesh.face_sizes.size()) + " faces and " +
                std::to_string(mesh.vertices.size()) + " vertices; at most " + std::to_string(kMaxTriangles) +
                " triangles are possible");
}

void check_corners(const Polygons& mesh) {
  const auto beyond = std::ranges::find_if(
      mesh.corners, [count = mesh.vertices.size()](std::uint32_t corner) { return corner >= count; });
  if (beyond == mesh.corners.end()) return;
  throw Refusal("which has a face with an index beyond its last vertex: vertex " + std::to_string(*beyond) + " of " +
                std::to_string(mesh.vertices.size()) + ", counted from 0; export the mesh again");
}

void check_finite(const Polygons& mesh) {
  for (const std::uint32_t corner : mesh.corners) {
    if (mesh.vertices[corner].allFinite()) continue;
    throw Refusal("which has a vertex that is not finite: vertex " + std::to_string(corner) +
                  ", counted from 0; repair the mesh");
  }
}

}  // namespace

Extent extent_of(const Polygons& mesh) {
  Extent extent;
  if (mesh.corners.empty()) return extent;
  Vec3 low = mesh.vertices[mesh.corners.front()], high = low;
  for (const std::uint32_t corner : mesh.corners) {
    low = low.cwiseMin(mesh.vertices[corner]);
    high = high.cwiseMax(mesh.vertices[corner]);
  }
  extent.size = (high - low).maxCoeff();
  extent.middle = low / 2 + high / 2;
  extent.farthest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  return extent;
}

void check(const Polygons& mesh) {
  check_count(mesh);
  check_corners(mesh);
  check_finite(mesh);
  const Extent extent = extent_of(mesh);
  const double step = std::max(mesh.step, extent.farthest * mesh.number_step);
  // A rounding step relative to size 0 is not defined. A mesh of size 0 is refused by a later check.
  if (extent.size == 0 || step <= extent.size * kMaxStepShare) return;
  throw Refusal("whose coordinates are too far from the origin: at a size of " + short_text(extent.size) +
                " units they are known in steps of " + short_text(step) +
                "; move the part to its origin and export it again");
}

}  // namespace tandem::server::mesh_reader
