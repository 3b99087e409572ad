// The triangles of a shape as a client gets them: what a point touches, or a window draws.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Of such an asset in the list that a server sends.
inline constexpr const char* kSurfaceAssetKind = "surface";
inline constexpr std::uint32_t kSurfaceAssetVersion = 1;
/// As many as a mesh file may have; the vertices of a welded mesh are fewer.
inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;
inline constexpr std::size_t kMaxSurfaceVertices = 1'000'000;
/// Of each coordinate: single precision is coarser than a tenth of a millimetre beyond.
inline constexpr double kMaxSurfaceReach_m = 1000;

/// A repaired mesh in single precision: vertices within 0.1 µm of where they were, up to 1 m from the origin.
///
/// Model   little-endian: "TSRF", version, counts of vertices and triangles; x y z of each vertex as float32 [m]; three
///         indices of each triangle, counter-clockwise seen from outside; a checksum of all that
/// Fails   std::invalid_argument: more than the limits above, none, an index out of range, a coordinate that is not
///         finite or too far
std::vector<std::byte> surface_asset_bytes(const TriangleMesh& mesh);

/// Nothing for bytes that are not exactly such an asset of this version; safe for hostile bytes: no more memory than a
/// small multiple of them is taken.
std::optional<TriangleMesh> surface_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
