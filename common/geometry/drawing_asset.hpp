// A shape for drawing, as bytes: triangles with normals, in levels from coarse to fine, compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/shading.hpp"

namespace tandem::geometry {

/// Kind of this asset in the asset list that a server sends.
inline constexpr const char* kDrawingAssetKind = "drawing";
inline constexpr std::uint32_t kDrawingAssetVersion = 1;
/// Triangle limits of the coarsest, the middle and the finest level. The two coarser levels exist only for meshes of at
/// least twice their limit.
inline constexpr std::size_t kDrawingLevels[] = {4'000, 60'000, 600'000};
inline constexpr std::size_t kMaxDrawingTriangles = kDrawingLevels[2];
inline constexpr std::size_t kMaxDrawingVertices = 3 * kMaxDrawingTriangles;

/// Returns the levels of detail of a mesh, from coarse to fine. The finest level has all triangles of the mesh, up to
/// kMaxDrawingTriangles. A level without triangles is left out, as happens with thousands of small parts.
std::vector<ShadedMesh> drawing_levels(const TriangleMesh& mesh);

/// Encodes one level.
///
/// Model   little-endian: "TDRW", version; corner and size of the mesh's box as float32 [m]; counts of vertices and
///         triangles; three blocks (packing.hpp); a checksum. Block 1: vertices on a grid of 2¹⁶ steps an axis, each as
///         its difference from the previous one. Block 2: normals as octahedral coordinates of one byte each, within
///         1°. Block 3: corners as their distance behind the newest vertex. Vertices are in the order of their first
///         use
/// Source  Cigolle et al., "A survey of efficient representations for independent unit vectors", JCGT 3(2), 2014: the
///         normals
/// Fails   std::invalid_argument: no triangle, more than the limits above, an index out of range, or a coordinate that
///         is not finite or beyond kMaxSurfaceReach_m
std::vector<std::byte> drawing_asset_bytes(const ShadedMesh& mesh);

/// Decodes one level. Returns none unless the bytes are exactly one asset of this version. Safe for hostile bytes.
std::optional<ShadedMesh> drawing_from(std::span<const std::byte> bytes);

}  // namespace tandem::geometry
