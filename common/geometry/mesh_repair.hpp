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

/// A mesh that contact assets can be built of: welded, without triangles that have no area or that are there twice,
/// turned consistently where that is possible; a solid's normals point out and its small holes are closed.
struct ContactMesh {
  TriangleMesh mesh;
  SurfaceKind kind = SurfaceKind::kSolid;
  std::vector<std::string> notes;  ///< for people: what was changed, with counts
};

/// Why a mesh cannot be touched, and what to do about it.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Fails   MeshError: no triangle left, a non-finite vertex, an index out of range, neither a solid nor a sheet
ContactMesh repaired(const TriangleMesh& mesh);

}  // namespace tandem::geometry
