// Tests whether triangles intersect each other.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::geometry {

/// Returns whether the segment from p to q crosses or touches a triangle, within `tolerance_m`. Near a sharp corner of
/// the triangle, segments at a slightly larger distance are accepted too. A triangle without area is never crossed.
bool meets(const std::array<Vec3, 3>& corners, const Vec3& p, const Vec3& q, double tolerance_m) noexcept;

/// Returns whether two triangles cross or touch each other. Each side of one triangle is tested against the other
/// triangle by meets().
bool meet(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, double tolerance_m) noexcept;

/// Returns the other triangles of a mesh that one triangle crosses or touches. A triangle that shares a vertex with
/// this one is included only if both also meet elsewhere.
///
/// In      tree   search tree of `mesh`
///         near   buffer for the search, reused between calls
/// Out     work   increased by the number of triangles examined
/// Cost    1 to 2 µs if the triangles have similar sizes
std::vector<std::size_t> crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::size_t triangle,
                                  double tolerance_m, std::vector<TriangleTree::Near>& near, std::size_t& work);

/// Calls visit(triangle, others) for each of `triangles` in order, until `visit` returns false. `others` is the result
/// of crossing() for the triangle. The calls, and the work that is counted, are the same for any number of threads.
void visit_crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::span<const int> triangles,
                    double tolerance_m, int threads, std::size_t& work,
                    const std::function<bool(std::size_t triangle, std::span<const std::size_t> others)>& visit);

}  // namespace tandem::geometry
