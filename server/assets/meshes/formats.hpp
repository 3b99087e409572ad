// Readers of the mesh formats that are lists of vertices and faces. They exist because Assimp reads coordinates in single
// precision and, of .ply and .off, skips faces and takes wrong vertices without a word.
//
// Bytes are hostile: memory is bounded by the file's length, and whatever does not follow the format is refused.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "server/assets/meshes/polygons.hpp"

namespace tandem::server::mesh_reader {

/// v and f of Wavefront; a free-form surface is refused by name.
Polygons polygons_of_obj(std::string_view text);

/// Text of Geomview, one vertex and one face a line; other columns are skipped.
Polygons polygons_of_off(std::string_view text);

/// Text or binary of either byte order: `face` and `tristrips`; other elements are skipped.
Polygons polygons_of_ply(std::span<const std::byte> bytes);

/// Text or binary.
Polygons polygons_of_stl(std::span<const std::byte> bytes);

}  // namespace tandem::server::mesh_reader
