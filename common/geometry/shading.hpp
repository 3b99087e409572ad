// A mesh as it is drawn: with normals, and with as few triangles as a picture needs.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// A mesh and the normal of its surface at each vertex, of length 1.
using ShadedMesh = std::pair<TriangleMesh, std::vector<Vec3>>;

/// The same triangles, smooth where neighbouring faces meet at less than 40°, with an edge where they meet at more: there is
/// one vertex for each of the smooth surfaces that meet in it.
///
/// Model   around a vertex, face after face: a face belongs to the first group whose normal, weighted by area, is within 40°
///         of its own
/// In      mesh  a triangle with a corner that is not there, or without an area, is left out
/// Cost    linear: directions that are 40° apart are few
ShadedMesh shaded(const TriangleMesh& mesh);

/// A mesh of at most `most` triangles, for a picture: no solid, and no manifold. One that has no more is left as it is.
///
/// Model   vertices in one cell of a grid become one, where it errs least from the planes of the faces around them: it
///         minimises Σ A² (n·(x − p))², and is in its cell; triangles with two corners in a cell go
/// Source  Lindstrom, "Out-of-core simplification of large polygonal models", SIGGRAPH 2000, §3; cells are widened until
///         there are few enough triangles
/// In      mesh  as TriangleMesh says; most  some hundred or more
/// Out     fewer, or none, of parts that are smaller than a cell
TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most);

}  // namespace tandem::geometry
