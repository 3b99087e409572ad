// Reads mesh files of any format. They come from outside the project, so sizes are bounded and vertices that are not
// finite are refused. The text of a std::runtime_error says why a file cannot be used, and names the remedy: "/x/y.obj,
// which does not exist; give …".
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Reads a whole file of at most 64 MiB.
/// In      remedy  advice for a missing file; for a data file from a Debian package, the package to install
/// Fails   std::runtime_error
std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy);

/// Returns the triangles of all parts of a mesh in one frame with z up. Vertices that differ only in colour or normal
/// are merged. The extension of `file` selects the format; messages name `file`. The format determines unit and up
/// axis: .gltf and .glb use metres and y, .dae its asset element, .3ds z. For other formats the unit is that of the
/// file, and z is up. Buffers of a .gltf are read from its folder or below.
/// Fails   std::runtime_error: the file is empty or not a mesh; it has more than a million triangles, or a vertex that
///         is not finite; rounding far from the origin changes its shape; or its extension is not supported
geometry::TriangleMesh mesh_of_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& file);

/// Returns whether the format states the unit, as .gltf, .glb and .dae do.
bool states_unit(const std::filesystem::path& file);
/// Returns whether the format states the up axis, as .gltf, .glb, .dae and .3ds do.
bool states_up_axis(const std::filesystem::path& file);

/// Returns whether a mesh is larger than objects usually touched with a haptic device. The usual cause is that
/// millimetres were taken for metres.
bool is_too_large(double size_m);

/// Returns a question to the user about an implausible size: "60 m large, if a unit of the file is 1 m: is that
/// right?". It applies to a mesh whose scale was not derived from a wanted size. Empty for a plausible size.
std::string doubt_of_size(double size_m, double scale_m, const std::filesystem::path& file);

/// Combines read_asset_file() and mesh_of_bytes().
geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy);

}  // namespace tandem::server
