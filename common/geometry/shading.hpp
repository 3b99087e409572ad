// Meshes for drawing, with vertex normals and a limited number of triangles.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// A mesh, and the unit normal of its surface at each vertex.
using ShadedMesh = std::pair<TriangleMesh, std::vector<Vec3>>;

/// Returns the same triangles with vertex normals. Adjacent faces at an angle below 40° belong to one smooth surface; a
/// larger angle appears as an edge. A vertex where several smooth surfaces meet is duplicated, once for each of them.
///
/// Model   Around each vertex, faces are grouped, one after another. A face joins the first group whose area-weighted
///         mean normal is within 40° of the face's normal, or begins a new group
/// In      mesh  triangles without area, or with an index out of range, are omitted
/// Cost    linear, because a vertex has only few groups that differ by 40°
ShadedMesh shaded(const TriangleMesh& mesh);

/// Returns a mesh for drawing with at most `most` triangles, which is neither closed nor manifold. A mesh within the
/// limit is returned unchanged.
///
/// Model   1. All vertices in one cell of a grid are merged into one vertex x.
///         2. x minimises Σ A² (n·(x − p))² over the faces at these vertices, with the area A, normal n and a corner p
///            of each face. The sum measures the distance of x from the planes of the faces. x is clamped to the cell.
///         3. Triangles with two corners in the same cell are removed
/// Source  Lindstrom, "Out-of-core simplification of large polygonal models", SIGGRAPH 2000, §3. In addition, we
///         enlarge the cells until the number of triangles is low enough
/// In      mesh  mesh with valid indices
///         most  some hundred or more
/// Out     a mesh in which parts smaller than a cell have fewer triangles or are missing
TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most);

}  // namespace tandem::geometry
