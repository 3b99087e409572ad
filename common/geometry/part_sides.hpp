// Classification of the two sides of the faces of a part that crosses itself or has unpaired edges. Private to the
// union of parts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {

/// Edge numbers of each triangle of a mesh; the numbering is arbitrary.
using EdgesOfTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Distance below which triangles touch, as a share of the mesh's diagonal.
inline constexpr double kTouching = 1e-7;
/// Work limit of one mesh, some seconds, and the cost of each operation in the same unit. A triangle found near another
/// costs 1, a test of whether two triangles meet in a cell kWorkPerMeeting, a query of the winding number
/// kWorkPerSample.
inline constexpr std::size_t kMaxWork = 40'000'000, kWorkPerMeeting = 4, kWorkPerSample = 400;

/// Inside or outside on both sides of every point on the triangles of a mesh. A connected region that meets no other
/// triangle has one classification. Triangles that meet others or have unpaired edges are divided into cells until
/// little area is ambiguous.
///
/// Thread  any, at the same time; a query allocates nothing
class PartSides {
 public:
  /// Classifies the whole mesh.
  ///
  /// In      mesh       must outlive this object
  ///         winding    winding number of the mesh, including inner triangles that repair removed
  ///         tree       search tree of the mesh
  ///         is_closed  every edge has two triangles
  ///         threads    number of threads to use; the result does not depend on it
  /// Out     work       increased by the work done. Beyond kMaxWork the remaining triangles stay unclassified, and
  ///         queries there use the winding number
  PartSides(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree, const EdgesOfTriangles& edges,
            bool is_closed, int threads, std::size_t& work);
  ~PartSides();

  /// Whether at this point the inside lies behind the triangle and the outside in front of it.
  bool is_face(int triangle, const Vec3& at_S) const noexcept;
  /// Whether a point is inside, given its closest point on the mesh.
  bool is_inside(const Vec3& p_S, int triangle, const Vec3& closest_S) const noexcept;
  const TriangleMesh& border() const;  ///< triangles and cells that do not have the inside on both sides
  bool has_inner() const;              ///< whether any triangle or cell has the inside on both sides
  int triangle_of_border(int triangle) const;

 private:
  class Cells;
  std::unique_ptr<const Cells> cells_;
};

}  // namespace tandem::geometry
