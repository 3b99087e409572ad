// Classifies the two sides of the triangles of a part that crosses itself or has unpaired edges. Used only to compute
// the union of parts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {

/// Edge numbers of each triangle in a mesh; the numbering is arbitrary.
using EdgesOfTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Distance below which triangles are treated as touching, as a fraction of the mesh's diagonal.
inline constexpr double kTouching = 1e-7;
/// Limit of the work for one mesh, which takes some seconds. The unit of work is finding one triangle near another one.
/// kWorkPerMeeting is the work of testing whether two triangles meet within a cell, kWorkPerSample that of a query of
/// the winding number.
inline constexpr std::size_t kMaxWork = 40'000'000, kWorkPerMeeting = 4, kWorkPerSample = 400;

/// Classifies both sides of every point on the triangles of a mesh as inside or outside. A connected region that meets
/// no other triangle has one classification. Triangles that meet others or have unpaired edges are divided into cells,
/// until only a small area remains ambiguous.
///
/// Thread  any number of threads at the same time; a query allocates nothing
class PartSides {
 public:
  /// Classifies the whole mesh.
  ///
  /// In      mesh       must outlive this object
  ///         winding    winding number of the mesh, including inner triangles that repair has removed
  ///         tree       search tree of the mesh
  ///         is_closed  true if every edge has two triangles
  ///         threads    number of threads to use; the result does not depend on it
  /// Out     work       increased by the work done. When it exceeds kMaxWork, the remaining triangles are not
  ///                    classified, and queries on them use the winding number
  PartSides(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree, const EdgesOfTriangles& edges,
            bool is_closed, int threads, std::size_t& work);
  ~PartSides();

  /// Returns whether, at this point, the inside is behind the triangle and the outside is in front of it.
  bool is_face(int triangle, const Vec3& at_S) const noexcept;
  /// Returns whether a point is inside, given its closest point on the mesh.
  bool is_inside(const Vec3& p_S, int triangle, const Vec3& closest_S) const noexcept;
  const TriangleMesh& border() const;  ///< triangles and cells, except those with the inside on both sides
  bool has_inner() const;              ///< true: some triangle or cell has the inside on both sides
  int triangle_of_border(int triangle) const;

 private:
  class Cells;
  std::unique_ptr<const Cells> cells_;
};

}  // namespace tandem::geometry
