#include "server/physics/convex_hull.hpp"

#include <LinearMath/btConvexHullComputer.h>

namespace tandem::server {

geometry::TriangleMesh convex_hull(const std::vector<Vec3>& points) {
  btConvexHullComputer computer;
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  computer.compute(points.front().data(), sizeof(Vec3), static_cast<int>(points.size()), 0, 0);
  geometry::TriangleMesh hull;
  for (int i = 0; i < computer.vertices.size(); ++i) {
    const btVector3& v = computer.vertices[i];
    hull.vertices.emplace_back(v.x(), v.y(), v.z());
  }
  // A face is a planar polygon, and `first` is one of its edges. The face is cut into triangles that share the start
  // vertex of `first`.
  for (int i = 0; i < computer.faces.size(); ++i) {
    const btConvexHullComputer::Edge* const first = &computer.edges[computer.faces[i]];
    const int apex = first->getSourceVertex();
    for (const auto* edge = first->getNextEdgeOfFace(); edge->getTargetVertex() != apex;
         edge = edge->getNextEdgeOfFace()) {
      hull.triangles.push_back({apex, edge->getSourceVertex(), edge->getTargetVertex()});
    }
  }
  return hull;
}

}  // namespace tandem::server
