// Mesh files of any format, read from outside the project: sizes bounded, every vertex finite. A std::runtime_error
// says why a file cannot be used and what to do about it: "/x/y.obj, which does not exist; give …".
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// The whole of a file of at most 64 MiB.
/// In      remedy  what to do when there is no such file; for a data file of Debian it is the package to install
/// Fails   std::runtime_error
std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy);

/// Triangles of all parts of a mesh in one frame with z up; corners that differ only in colour or normal are joined. The
/// unit and the axis that is up are those that the file states: of .gltf and .glb metres and y, of .dae its asset's, of
/// .3ds z; else a unit is the file's, and z is up. `file` tells the format by its extension and is named in messages.
/// Beside `bytes`, the buffers of a .gltf are read that lie in its folder or below.
/// Fails   std::runtime_error: empty, not a mesh, more than a million triangles, a vertex that is not finite, coordinates
///         whose rounding far from the origin changes the shape, an extension that is not read
geometry::TriangleMesh mesh_of_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& file);

/// Whether the format states the unit, as .gltf, .glb and .dae do.
bool states_unit(const std::filesystem::path& file);
/// Whether the format states the axis that is up: those, and .3ds.
bool states_up_axis(const std::filesystem::path& file);

/// Longer than what people touch with a haptic device: mostly millimetres taken for metres.
bool is_too_large(double size_m);

/// A question about a size that hardly is that of a thing in a hand, for a mesh whose scale was not chosen by its size:
/// "60 m large, for a unit of the file is 1 m: is that right?". Empty for a plausible one.
std::string doubt_of_size(double size_m, double scale_m, const std::filesystem::path& file);

/// read_asset_file() and mesh_of_bytes().
geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy);

}  // namespace tandem::server
