// Readers of mesh formats that are lists of vertices and faces. They are used instead of Assimp, which reads
// coordinates in single precision. In .ply and .off files, Assimp also skips faces and uses wrong vertices without a
// message.
//
// The bytes may be hostile. The length of the file bounds the memory, and deviations from the format are refused.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "server/assets/meshes/polygons.hpp"

namespace tandem::server::mesh_reader {

/// Reads the lines v and f of Wavefront .obj. A free-form surface is refused, with its name in the message.
Polygons polygons_of_obj(std::string_view text);

/// Reads Geomview text with one vertex or one face per line. Further columns, such as colours, are skipped.
Polygons polygons_of_off(std::string_view text);

/// Reads Stanford .ply, text or binary of either byte order. Elements other than `vertex`, `face` and `tristrips` are
/// skipped.
Polygons polygons_of_ply(std::span<const std::byte> bytes);

/// Reads STL, text or binary.
Polygons polygons_of_stl(std::span<const std::byte> bytes);

}  // namespace tandem::server::mesh_reader
