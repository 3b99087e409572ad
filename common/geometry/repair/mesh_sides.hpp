// Finds triangles with a solid on one side, on both, or on neither. Private to the repair of meshes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Classification of a triangle: border between inside and outside, or the same on both sides.
enum class Side : std::uint8_t { kBorder, kInside, kOutside };

/// Classifies each triangle by the winding number of the others. A triangle that lies on another is classified by the
/// winding number beside it, off both sides.
///
/// Cost    a few microseconds a triangle, on all processors
std::vector<Side> sides_of(const TriangleMesh& mesh);

std::vector<int> those_of(const std::vector<Side>& sides, Side side);

/// Returns the inside triangles of those parts that also have border triangles.
///
/// In      sides  sides of the triangles of the parts, one part after the other
/// Out     indices in that order
std::vector<int> inner_of(const std::vector<MeshPart>& parts, const std::vector<Side>& sides);

/// Returns, for each part of a surface, the share of its area from which a straight ray leaves the inside without
/// crossing a triangle. A few hundred rays sample it. For closed parts it is 0.
///
/// In      all  triangles that define the inside, including the parts
std::vector<double> open_shares(const TriangleMesh& surface, const std::vector<MeshPart>& parts,
                                const TriangleMesh& all);

}  // namespace tandem::geometry
