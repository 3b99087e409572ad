// Meshes come from anywhere: with seams, holes, flipped patches, or turned inside out. What touches a hand needs a
// surface with a known inside, or a known sheet. This makes one of it, says what it changed, or says why it cannot.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// kSolid: encloses a volume. kSheet: an open surface, touchable from both sides.
enum class SurfaceKind : std::uint8_t { kSolid, kSheet };

/// What one part of a mesh, or several that hang together, was taken for.
struct PartReport {
  SurfaceKind kind = SurfaceKind::kSolid;
  std::size_t triangles = 0;
  std::size_t parts = 1;  ///< that are alike in this
  double volume_m3 = 0;   ///< of a solid
  std::size_t holes = 0;  ///< closed, of a solid; open, of a sheet
  std::string why;        ///< in words
};

/// A mesh that contact assets can be built of: welded, without triangles that have no area or that are there twice,
/// turned consistently where that is possible; a solid's normals point out and its small holes are closed.
struct ContactMesh {
  TriangleMesh mesh;
  SurfaceKind kind = SurfaceKind::kSolid;
  std::vector<std::string> notes;  ///< for people: what was changed, with counts
  TriangleMesh sheet{};            ///< of a solid: what beside it is open
  TriangleMesh inner{};  ///< what goes on inside the solid from its surface: no surface, but of its winding number
  std::vector<PartReport> parts{};  ///< what each was taken for, the largest first
};

/// Why a mesh cannot be touched, and what to do about it.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What is inside is told by the winding number where edges do not pair up: walls inside are left out, flipped triangles
/// turned, and what has the outside on both sides, or an inside that one gets out of, is a sheet.
///
/// Fails   MeshError: no triangle left, a non-finite vertex, an index out of range, or too many parts
ContactMesh repaired(const TriangleMesh& mesh);

/// Both in one, with vertices of their own.
TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other);
/// Solid and sheet in one.
TriangleMesh all_of(const ContactMesh& mesh);

/// What its parts were taken for, a line each, the largest first; after the tenth how many more there are.
std::vector<std::string> part_lines(const ContactMesh& mesh);

}  // namespace tandem::geometry
