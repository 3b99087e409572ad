// Checks for features of .gltf and .glb that Assimp reads wrongly without a message: packed and quantised positions,
// instancing extensions, and morph weights. Each is refused with the name of its field.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace tandem::server::mesh_reader {

/// Checks a .gltf or .glb for these features, and counts its triangles.
/// Out     number of triangles of all meshes according to their accessors; nothing for version 1 of glTF
/// Fails   Refusal: the file uses one of these features
std::optional<std::size_t> checked_gltf_triangles(std::span<const std::byte> bytes);

}  // namespace tandem::server::mesh_reader
