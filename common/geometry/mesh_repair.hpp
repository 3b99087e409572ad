// Mesh repair. Meshes from files may have seams, holes or flipped patches, or may be inside out. Contact requires a
// solid with a defined inside, or a sheet. Repair makes a solid or a sheet and reports its changes, or fails and
// reports the reason.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// kSolid: a closed surface that encloses a volume. kSheet: an open surface, with contact from both sides.
enum class SurfaceKind : std::uint8_t { kSolid, kSheet };

/// Kind and measures of one part of a mesh, or of several parts of the same kind.
struct PartReport {
  SurfaceKind kind = SurfaceKind::kSolid;
  std::size_t triangles = 0;
  std::size_t parts = 1;  ///< number of parts that this report describes
  double volume_m3 = 0;   ///< volume of a solid; 0 for a sheet
  std::size_t holes = 0;  ///< for a solid: number of holes that were closed; for a sheet: number of open borders
  std::string why;        ///< reason for the classification, for users
};

/// A mesh from which contact assets can be built. It is welded, has no degenerate or duplicate triangles, and is
/// consistently oriented unless its surface is not orientable. The normals of a solid point outwards, and its small
/// holes are closed.
struct ContactMesh {
  TriangleMesh mesh;
  SurfaceKind kind = SurfaceKind::kSolid;
  std::vector<std::string> notes;  ///< text for users: each kind of change that repair made, with its count
  TriangleMesh sheet{};            ///< open parts of a mesh that also has a solid
  /// Triangles inside the solid that repair has removed from the surface. They are used only for the solid's winding
  /// number.
  TriangleMesh inner{};
  std::vector<PartReport> parts{};  ///< one report for each kind of part, sorted by decreasing number of triangles
};

/// Reason why a mesh cannot be used for contact, with the remedy.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Repairs a mesh. Unpaired edges do not show which side of a triangle is inside. The winding number then classifies
/// both sides of each triangle:
/// * inside on exactly one side: the triangle is a part of the solid's surface. It is reversed if its normal points
///   inwards.
/// * inside on both sides: the triangle is an inner wall and is removed.
/// * inside on neither side: the triangle becomes a part of a sheet. Parts with an opening become a sheet, too.
///
/// Fails   MeshError: no triangle is left, a vertex is not finite, an index is out of range, or there are too many
///         parts
ContactMesh repaired(const TriangleMesh& mesh);

/// Returns one mesh with the triangles of both meshes. Vertices at the same position are not merged.
TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other);
/// Returns one mesh with the solid and the sheet.
TriangleMesh all_of(const ContactMesh& mesh);

/// Describes the parts, one line each, sorted by decreasing number of triangles. There are at most ten such lines; a
/// further line gives the number of the remaining parts.
std::vector<std::string> part_lines(const ContactMesh& mesh);

}  // namespace tandem::geometry
