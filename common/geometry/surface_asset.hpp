// The triangles of a shape as bytes for clients, which test points against them or draw them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Kind of this asset in the asset list that a server sends.
inline constexpr const char* kSurfaceAssetKind = "surface";
inline constexpr std::uint32_t kSurfaceAssetVersion = 1;
/// Limits of a mesh, the same as for mesh files. A welded mesh has fewer vertices than its file.
inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;
inline constexpr std::size_t kMaxSurfaceVertices = 1'000'000;
/// Limit of each coordinate; beyond it, single precision is coarser than 0.1 mm.
inline constexpr double kMaxSurfaceReach_m = 1000;

/// Encodes a repaired mesh in single precision. Vertices move by at most 0.1 µm within 1 m of the origin.
///
/// Model   little-endian: "TSRF", version, counts of vertices and triangles; x y z of each vertex as float32 [m]; three
///         indices of each triangle, counter-clockwise seen from outside; a checksum of all that
/// Fails   std::invalid_argument: no triangle, more triangles or vertices than the limits above, an index out of range,
///         or a coordinate that is not finite or too far
std::vector<std::byte> surface_asset_bytes(const TriangleMesh& mesh);

/// Decodes an asset. Returns none unless the bytes are exactly one asset of this version. Safe for hostile bytes:
/// memory is bounded by a small multiple of their number.
std::optional<TriangleMesh> surface_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
