// A shape as a window gets it: triangles with normals, in levels from coarse to fine, packed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/shading.hpp"

namespace tandem::geometry {

/// Of such an asset in the list that a server sends.
inline constexpr const char* kDrawingAssetKind = "drawing";
inline constexpr std::uint32_t kDrawingAssetVersion = 1;
/// Of the coarsest level, the next, and the finest; a mesh of fewer than twice as many has no level of that.
inline constexpr std::size_t kDrawingLevels[] = {4'000, 60'000, 600'000};
inline constexpr std::size_t kMaxDrawingTriangles = kDrawingLevels[2];
inline constexpr std::size_t kMaxDrawingVertices = 3 * kMaxDrawingTriangles;

/// What is drawn of a mesh, from coarse to fine: the finest level has as many triangles as the mesh, and kMaxDrawingTriangles
/// at most. Levels of which nothing is left (thousands of small parts) are left out.
std::vector<ShadedMesh> drawing_levels(const TriangleMesh& mesh);

/// Model   little-endian: "TDRW", version; corner and size of the mesh's box as float32 [m]; counts of vertices and
///         triangles; three blocks (packing.hpp): vertices on a grid of 2¹⁶ steps an axis, each as what it is beyond the one
///         before; normals as an octahedron's two coordinates of a byte (Cigolle et al., "A survey of efficient
///         representations for independent unit vectors", JCGT 3(2), 2014: within 1°); corners as how far they are behind
///         the newest vertex. Vertices are in the order of their first use. A checksum of all that
/// Fails   std::invalid_argument: no triangle, more than the limits above, a corner that is not there, a coordinate that is
///         not finite or beyond kMaxSurfaceReach_m
std::vector<std::byte> drawing_asset_bytes(const ShadedMesh& mesh);

/// Nothing for bytes that are not exactly such an asset of this version; safe for hostile bytes.
std::optional<ShadedMesh> drawing_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
