// Adapter of Assimp: reads scenes of .dae, .gltf, .glb and .3ds as polygons, and cuts polygons into triangles. Assimp
// computes in single precision. So the poses of a scene are applied here, and polygons are cut near the origin at about
// unit size.
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

/// A file that was given, or only its name.
struct GivenFile {
  std::string name;
  std::span<const std::byte> bytes;
};

/// Returns all meshes of a scene in one frame with z up, in metres where the format has a unit.
/// In      files  the scene first, named mesh.FORMAT; then its additional files
///         expected_faces  number of faces of all its meshes, if the file states it
///         shift           offset that is added to the vertices of its meshes
/// Fails   Refusal
Polygons polygons_of_scene(const std::vector<GivenFile>& files, std::optional<std::size_t> expected_faces,
                           const Vec3& shift = Vec3::Zero());

/// Cuts each polygon into triangles; vertices at the same position are merged.
geometry::TriangleMesh triangulated(const Polygons& mesh);

/// Triangles as Assimp reads the file, in single precision; nothing if it fails or reads another number of faces.
std::optional<geometry::TriangleMesh> assimp_triangles(const std::vector<GivenFile>& files, std::size_t expected_faces);

}  // namespace tandem::server::mesh_reader
