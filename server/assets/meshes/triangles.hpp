// Adapter of Assimp. It reads scenes of .dae, .gltf, .glb and .3ds as polygons, and cuts polygons into triangles.
// Assimp computes in single precision. To keep accuracy, this adapter applies the poses of a scene itself. It also
// moves polygons near the origin, and scales them to about unit size, before Assimp cuts them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "server/assets/meshes/polygons.hpp"

namespace tandem::server::mesh_reader {

/// A file with its bytes, or only its name.
struct GivenFile {
  std::string name;
  std::span<const std::byte> bytes;
};

/// Returns all meshes of a scene in one frame with z up. The unit is the metre if the format defines a unit.
/// In      files  the scene file, named mesh.FORMAT, followed by its additional files
///         expected_faces  number of faces of all meshes, if the file states it
///         shift           offset that is added to the vertices of the meshes
/// Fails   Refusal
Polygons polygons_of_scene(const std::vector<GivenFile>& files, std::optional<std::size_t> expected_faces,
                           const Vec3& shift = Vec3::Zero());

/// Cuts each polygon into triangles, and merges vertices at the same position.
geometry::TriangleMesh triangulated(const Polygons& mesh);

/// Returns the triangles that Assimp reads from the file, in single precision. Returns nothing if reading fails or the
/// number of faces differs from `expected_faces`.
std::optional<geometry::TriangleMesh> assimp_triangles(const std::vector<GivenFile>& files, std::size_t expected_faces);

}  // namespace tandem::server::mesh_reader
