// Reads mesh files of any supported format. The files may be hostile, so sizes are bounded and vertices that are not
// finite are refused. The text of a std::runtime_error contains the file, the reason and the remedy, for example
// "/x/y.obj, which does not exist; give …".
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Reads a whole file of at most 64 MiB.
/// In      remedy  advice in the message about a missing file. For a data file of a known Debian package, the message
///         names that package instead
/// Fails   std::runtime_error
std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy);

/// Returns the triangles of all parts of a mesh in one frame with z up. Vertices at equal positions that differ only in
/// colour or normal are merged. The extension of `file` selects the format, and messages contain `file`. Buffers of a
/// .gltf are read from its folder or a folder below. Unit and up axis of the vertices in the file are:
/// * .gltf, .glb: metre, y up
/// * .dae: as its asset element states
/// * .3ds: unit of the file, z up
/// * other formats: unit of the file, z up
/// Fails   std::runtime_error in these cases:
///         * The file is empty or not a mesh, or its extension is not supported.
///         * It has more than a million triangles, or a vertex that is not finite.
///         * The mesh is so far from the origin that rounding changes its shape.
geometry::TriangleMesh mesh_of_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& file);

/// Returns whether the format defines the unit, as .gltf, .glb and .dae do.
bool states_unit(const std::filesystem::path& file);
/// Returns whether the format defines the up axis, as .gltf, .glb, .dae and .3ds do.
bool states_up_axis(const std::filesystem::path& file);

/// Returns whether a mesh is implausibly large for a haptic device. The usual cause is a file in millimetres whose
/// numbers were read as metres.
bool is_too_large(double size_m);

/// Returns a question to the user if a size is implausible, for example "60 m large, if a unit of the file is 1 m: is
/// that right?". Returns an empty string for a plausible size. Not meant for a mesh that was scaled to a requested
/// size.
std::string doubt_of_size(double size_m, double scale_m, const std::filesystem::path& file);

/// Combines read_asset_file() and mesh_of_bytes().
geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy);

}  // namespace tandem::server
