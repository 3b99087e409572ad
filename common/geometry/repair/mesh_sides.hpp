// Determines whether a triangle has the solid on one side, on both sides or on neither. Used only by mesh repair.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Classification of a triangle by the position of the solid's inside. kBorder: on one side only. kInside: on both
/// sides. kOutside: on neither side.
enum class Side : std::uint8_t { kBorder, kInside, kOutside };

/// Classifies each triangle by the winding number of all other triangles. If a triangle coincides with another one, the
/// winding numbers at a small distance on both sides are used instead.
///
/// Cost    a few microseconds per triangle; all processors are used
std::vector<Side> sides_of(const TriangleMesh& mesh);

std::vector<int> those_of(const std::vector<Side>& sides, Side side);

/// Returns the inner triangles of those parts that have border triangles, too.
///
/// In      sides  sides of the triangles of all parts, one part after another
/// Out     indices into `sides`
std::vector<int> inner_of(const std::vector<MeshPart>& parts, const std::vector<Side>& sides);

/// Returns the open fraction of the area of each part of a surface. A point is open if a straight ray from it can leave
/// the inside without crossing a triangle. The fraction is estimated by a few hundred rays. It is 0 for closed parts.
///
/// In      all  all triangles that define the inside, including those of the parts
std::vector<double> open_shares(const TriangleMesh& surface, const std::vector<MeshPart>& parts,
                                const TriangleMesh& all);

}  // namespace tandem::geometry
