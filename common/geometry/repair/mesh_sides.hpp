// Which triangles of a surface have a solid on one side, and which on both or on neither. Private to the repair of meshes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// What a triangle is: between inside and outside, or with one of them on both sides.
enum class Side : std::uint8_t { kBorder, kInside, kOutside };

/// Of each triangle, by the winding number of the others; of those that lie on another, by that off both sides.
/// Cost    a few microseconds a triangle, on all processors
std::vector<Side> sides_of(const TriangleMesh& mesh);

std::vector<int> those_of(const std::vector<Side>& sides, Side side);

/// What is inside of those parts that come out of the solid somewhere.
///
/// In      sides  of the triangles of the parts, one after the other
/// Out     by that order
std::vector<int> inner_of(const std::vector<MeshPart>& parts, const std::vector<Side>& sides);

/// Of each part of a surface with one side inside, the share of its area from where one gets out, straight ahead, without crossing
/// anything; as a few hundred rays in it say. None of what is closed.
///
/// In      all  what the inside is told by, the parts among it
std::vector<double> open_shares(const TriangleMesh& surface, const std::vector<MeshPart>& parts,
                                const TriangleMesh& all);

}  // namespace tandem::geometry
