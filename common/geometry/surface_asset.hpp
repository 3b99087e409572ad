// Encodes the triangles of a shape for clients. Clients test points against the triangles or draw them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Kind of this asset in the list of assets that a server sends.
inline constexpr const char* kSurfaceAssetKind = "surface";
inline constexpr std::uint32_t kSurfaceAssetVersion = 1;
/// Limits of a mesh, the same as for mesh files. Welding never increases the number of vertices.
inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;
inline constexpr std::size_t kMaxSurfaceVertices = 1'000'000;
/// Largest magnitude of a coordinate. Above it, the resolution of single precision would be coarser than 0.1 mm.
inline constexpr double kMaxSurfaceReach_m = 1000;

/// Encodes a repaired mesh in single precision, which moves vertices by at most 0.1 µm within 1 m of the origin.
///
/// Model   The bytes are little-endian: "TSRF", version, numbers of vertices and triangles; x y z of each vertex as
///         float32 [m]; three indices of each triangle, counter-clockwise when seen from outside; a checksum of all
///         preceding bytes
/// Fails   std::invalid_argument: no triangle, more triangles or vertices than the limits above, an index out of range,
///         or a coordinate that is not finite or too large
std::vector<std::byte> surface_asset_bytes(const TriangleMesh& mesh);

/// Decodes an asset. Returns nothing unless the bytes are exactly one asset of this version. Safe for malicious input:
/// the memory used is at most a small multiple of the input.
std::optional<TriangleMesh> surface_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
