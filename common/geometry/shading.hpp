// Meshes for drawing: with vertex normals, and with a limited number of triangles.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// A mesh and the unit normal of its surface at each vertex.
using ShadedMesh = std::pair<TriangleMesh, std::vector<Vec3>>;

/// Returns the same triangles with vertex normals. Neighbouring faces that meet at less than 40° are shaded smoothly; a
/// larger angle gives an edge. A vertex is duplicated for each smooth surface that meets in it.
///
/// Model   the faces around a vertex are assigned one by one: to the first group whose area-weighted normal is within
///         40° of the face's normal
/// In      mesh  triangles without area or with an index out of range are dropped
/// Cost    linear, because a vertex has few groups that are 40° apart
ShadedMesh shaded(const TriangleMesh& mesh);

/// Returns a mesh of at most `most` triangles for drawing, neither closed nor manifold. A mesh within the limit is
/// returned unchanged.
///
/// Model   the vertices in one cell of a grid are merged. The merged vertex minimises Σ A² (n·(x − p))², its error from
///         the planes of the faces around it, and is clamped to the cell. Triangles with two corners in one cell are
///         dropped
/// Source  Lindstrom, "Out-of-core simplification of large polygonal models", SIGGRAPH 2000, §3; here the cells are
///         widened until few enough triangles are left
/// In      mesh  valid indices; most  some hundred or more
/// Out     parts smaller than a cell lose triangles or disappear
TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most);

}  // namespace tandem::geometry
