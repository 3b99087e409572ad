// What Assimp reads wrongly of .gltf and .glb without a word: packed and quantised positions, copies by extension, weights
// of shapes. Each is refused by the name of its field.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace tandem::server::mesh_reader {

/// Out     triangles of all meshes, as their accessors count them; nothing for version 1
/// Fails   Refusal
std::optional<std::size_t> checked_gltf_triangles(std::span<const std::byte> bytes);

}  // namespace tandem::server::mesh_reader
