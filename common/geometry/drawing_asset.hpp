// Encodes a shape for drawing: triangles with normals, in levels of detail from coarse to fine, compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/shading.hpp"

namespace tandem::geometry {

/// Kind of this asset in the list of assets that a server sends.
inline constexpr const char* kDrawingAssetKind = "drawing";
inline constexpr std::uint32_t kDrawingAssetVersion = 1;
/// Maximum numbers of triangles of the coarsest, the middle and the finest level. The coarsest and the middle level
/// exist only if the mesh has at least twice as many triangles as the limit of that level.
inline constexpr std::size_t kDrawingLevels[] = {4'000, 60'000, 600'000};
inline constexpr std::size_t kMaxDrawingTriangles = kDrawingLevels[2];
inline constexpr std::size_t kMaxDrawingVertices = 3 * kMaxDrawingTriangles;

/// Returns the levels of detail of a mesh, from coarse to fine. The finest level has all triangles of the mesh. If
/// there are more than kMaxDrawingTriangles, it is decimated. Levels that have no triangle after decimation are
/// omitted, as happens for a mesh of thousands of small parts.
std::vector<ShadedMesh> drawing_levels(const TriangleMesh& mesh);

/// Encodes one level of detail.
///
/// Model   The bytes are little-endian: "TDRW", version; lowest corner and size of the mesh's bounding box as float32
///         [m]; numbers of vertices and triangles; three blocks (packing.hpp); a checksum. Vertices are in the order of
///         their first use.
///         Block 1: vertices on a grid of 2¹⁶ steps per axis, each stored as its difference from the previous vertex.
///         Block 2: normals as two octahedral coordinates of one byte each, accurate to 1°.
///         Block 3: triangle corners, each stored as the lowest unused vertex index minus the corner's index
/// Source  normals: Cigolle et al., "A survey of efficient representations for independent unit vectors", JCGT 3(2),
///         2014
/// Fails   std::invalid_argument: no triangle, more than the limits above, an index out of range, or a coordinate that
///         is not finite or exceeds kMaxSurfaceReach_m
std::vector<std::byte> drawing_asset_bytes(const ShadedMesh& mesh);

/// Decodes one level of detail. Returns nothing unless the bytes are exactly one asset of this version. Safe for
/// malicious input.
std::optional<ShadedMesh> drawing_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
