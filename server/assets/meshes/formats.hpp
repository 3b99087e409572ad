// Readers of mesh formats that are lists of vertices and faces. Assimp is not used for them, because it reads
// coordinates in single precision. In .ply and .off it also skips faces and uses wrong vertices without a message.
//
// The bytes may be hostile: the file's length bounds the memory, and deviations from the format are refused.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "server/assets/meshes/polygons.hpp"

namespace tandem::server::mesh_reader {

/// Wavefront .obj: v and f; a free-form surface is refused by name.
Polygons polygons_of_obj(std::string_view text);

/// Geomview text, one vertex and one face in each line; other columns are skipped.
Polygons polygons_of_off(std::string_view text);

/// Text, or binary of either byte order. Reads `face` and `tristrips`; other elements are skipped.
Polygons polygons_of_ply(std::span<const std::byte> bytes);

/// Text or binary STL.
Polygons polygons_of_stl(std::span<const std::byte> bytes);

}  // namespace tandem::server::mesh_reader
