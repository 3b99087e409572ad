// Mesh repair. Meshes arrive with seams, holes, flipped patches, or turned inside out; contact needs a solid with a
// known inside, or a sheet. Repair produces one of them and reports its changes, or fails with the reason.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// kSolid: encloses a volume. kSheet: an open surface, touchable from both sides.
enum class SurfaceKind : std::uint8_t { kSolid, kSheet };

/// Classification of one part of a mesh, or of several parts taken together.
struct PartReport {
  SurfaceKind kind = SurfaceKind::kSolid;
  std::size_t triangles = 0;
  std::size_t parts = 1;  ///< number of parts with this classification
  double volume_m3 = 0;   ///< volume of a solid; else 0
  std::size_t holes = 0;  ///< number of closed holes of a solid, or of open borders of a sheet
  std::string why;        ///< reason, for users
};

/// A mesh that contact assets can be built from: welded, without degenerate or duplicate triangles, and consistently
/// oriented where possible. The normals of a solid point outwards, and its small holes are closed.
struct ContactMesh {
  TriangleMesh mesh;
  SurfaceKind kind = SurfaceKind::kSolid;
  std::vector<std::string> notes;  ///< changes with their counts, for users
  TriangleMesh sheet{};            ///< open parts beside a solid
  TriangleMesh inner{};  ///< continuations of the surface inside the solid; they count only in its winding number
  std::vector<PartReport> parts{};  ///< one report for each classification, the largest first
};

/// Reason why a mesh cannot be touched, with the remedy.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Repairs a mesh. Where edges are unpaired, the winding number classifies the sides: walls inside are removed and
/// flipped triangles turned. Triangles with the outside on both sides, and enclosures with an open mouth, become
/// sheets.
///
/// Fails   MeshError: no triangle left, a non-finite vertex, an index out of range, or too many parts
ContactMesh repaired(const TriangleMesh& mesh);

/// Returns both meshes as one; no vertices are shared.
TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other);
/// Returns solid and sheet as one mesh.
TriangleMesh all_of(const ContactMesh& mesh);

/// Describes the parts, one line each, the largest first. After ten lines, one line gives the number of the others.
std::vector<std::string> part_lines(const ContactMesh& mesh);

}  // namespace tandem::geometry
