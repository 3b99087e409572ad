// Mesh files of any format. They come from outside the project, so sizes are bounded and every vertex is finite. The
// text of a std::runtime_error says why a file cannot be used and gives the remedy: "/x/y.obj, which does not exist;
// give …".
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Reads a whole file of at most 64 MiB.
/// In      remedy  advice for a missing file; for a data file of Debian the package to install
/// Fails   std::runtime_error
std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy);

/// Returns the triangles of all parts of a mesh in one frame with z up. Corners that differ only in colour or normal
/// are joined. The extension of `file` selects the format; messages name `file`. Unit and up axis follow the format:
/// .gltf and .glb metres and y, .dae its asset element, .3ds z. For other formats the unit is that of the file, and z
/// is up. Buffers of a .gltf are read from its folder or below.
/// Fails   std::runtime_error: empty, not a mesh, more than a million triangles, a vertex that is not finite,
///         coordinates whose rounding far from the origin changes the shape, an extension that is not read
geometry::TriangleMesh mesh_of_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& file);

/// Returns whether the format states the unit, as .gltf, .glb and .dae do.
bool states_unit(const std::filesystem::path& file);
/// Returns whether the format states the up axis, as .gltf, .glb, .dae and .3ds do.
bool states_up_axis(const std::filesystem::path& file);

/// Returns whether a mesh is larger than objects usually touched with a haptic device; often millimetres were taken for
/// metres.
bool is_too_large(double size_m);

/// Question to the user about an implausible size, for a mesh whose scale was not chosen by its size: "60 m large, for
/// a unit of the file is 1 m: is that right?". Empty for a plausible size.
std::string doubt_of_size(double size_m, double scale_m, const std::filesystem::path& file);

/// Combines read_asset_file() and mesh_of_bytes().
geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy);

}  // namespace tandem::server
