// Assimp as Tandem uses it: the scenes of .dae, .gltf, .glb and .3ds as polygons, and polygons cut into triangles. It
// computes in single precision, so that scenes are placed here, and polygons are cut near the origin at about unit size.
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

/// A file that was given, or its name alone.
struct GivenFile {
  std::string name;
  std::span<const std::byte> bytes;
};

/// All meshes of a scene in one frame, z up, in metres where the format has a unit.
/// In      files  the first is the scene and named mesh.FORMAT; those that it needs follow
///         expected_faces  of all its meshes, if the file says it
///         shift           of its meshes, to be added to their vertices
/// Fails   Refusal
Polygons polygons_of_scene(const std::vector<GivenFile>& files, std::optional<std::size_t> expected_faces,
                           const Vec3& shift = Vec3::Zero());

/// Each polygon as triangles; vertices at the same place are one.
geometry::TriangleMesh triangulated(const Polygons& mesh);

/// As Assimp reads the file, in single precision; nothing where it fails or reads another number of faces.
std::optional<geometry::TriangleMesh> assimp_triangles(const std::vector<GivenFile>& files, std::size_t expected_faces);

}  // namespace tandem::server::mesh_reader
