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

/// Whether the segment from p to q crosses or touches a triangle, within `tolerance_m`. Beside a sharp corner of the
/// triangle the test also accepts segments that are somewhat farther away. A triangle without area is never met.
bool meets(const std::array<Vec3, 3>& corners, const Vec3& p, const Vec3& q, double tolerance_m) noexcept;

/// Whether two triangles cross or touch each other, by the same test.
bool meet(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, double tolerance_m) noexcept;

/// Returns the other triangles of a mesh that one triangle crosses or touches. Neighbours that share a vertex with it
/// count only if they also meet it elsewhere.
///
/// In      tree   search tree of `mesh`
///         near   buffer for the search, reused between calls
/// Out     work   increased by the number of triangles examined
/// Cost    1 to 2 µs where the triangles have similar sizes
std::vector<std::size_t> crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::size_t triangle,
                                  double tolerance_m, std::vector<TriangleTree::Near>& near, std::size_t& work);

/// Calls visit(triangle, others) for each of `triangles` in order, with the result of crossing(), until `visit` returns
/// false. The calls and the work do not depend on the number of threads.
void visit_crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::span<const int> triangles,
                    double tolerance_m, int threads, std::size_t& work,
                    const std::function<bool(std::size_t triangle, std::span<const std::size_t> others)>& visit);

}  // namespace tandem::geometry
