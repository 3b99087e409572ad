// Whether triangles go through each other.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::geometry {

/// Whether a segment from p to q goes through a triangle or touches it, within `tolerance_m`; beside a sharp corner even if it
/// is somewhat farther off. None does with a triangle that has no area.
bool meets(const std::array<Vec3, 3>& corners, const Vec3& p, const Vec3& q, double tolerance_m) noexcept;

/// Whether two triangles go through each other or touch, likewise.
bool meet(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, double tolerance_m) noexcept;

/// The other triangles of a mesh that one meets, likewise; those that it shares vertices with, if they meet elsewhere too.
///
/// In      tree   of the mesh
///         near   space for the search, one for many
/// Out     work   more by how many others were looked at
/// Cost    a microsecond or two where triangles are of about one size
std::vector<std::size_t> crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::size_t triangle,
                                  double tolerance_m, std::vector<TriangleTree::Near>& near, std::size_t& work);

/// Calls visit(triangle, others) for some triangles, one after the other, with what crossing() finds, until it gives false. The calls and
/// the work are the same for any number of threads.
void visit_crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::span<const int> triangles,
                    double tolerance_m, int threads, std::size_t& work,
                    const std::function<bool(std::size_t triangle, std::span<const std::size_t> others)>& visit);

}  // namespace tandem::geometry
