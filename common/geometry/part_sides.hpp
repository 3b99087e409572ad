// What is inside beside the faces of a part that crosses itself, or has edges that do not pair up. Private to the union of parts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {

/// Of each triangle of a mesh, its edges by any numbers.
using EdgesOfTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Of the diagonal of what is looked at: what is nearer to each other touches.
inline constexpr double kTouching = 1e-7;
/// What is spent on one mesh, some seconds, and what each look costs: at a triangle that is near to another, at whether the two meet in
/// a piece of one, and at a winding number.
inline constexpr std::size_t kMaxWork = 40'000'000, kWorkPerMeeting = 4, kWorkPerLook = 400;

/// What is on the sides of the triangles of a mesh, everywhere on them. Where they meet others or have edges that do not pair up,
/// they are divided until little is left of them that may be one thing or the other; a connected region that meets no other triangle is
/// one thing.
///
/// Thread  any, at the same time; a query allocates nothing
class PartSides {
 public:
  /// In      mesh       it must live as long
  ///         winding    of the mesh, with what of it is inside and left out
  ///         tree       of the mesh
  ///         is_closed  each edge has two triangles
  ///         threads    to find out with; what is found does not depend on them
  /// Out     work       more by what it took; where that is more than kMaxWork, the winding number is asked at each place instead
  PartSides(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree, const EdgesOfTriangles& edges,
            bool is_closed, int threads, std::size_t& work);
  ~PartSides();

  /// Whether a triangle has the inside behind it there and the outside before it.
  bool is_face(int triangle, const Vec3& at_S) const noexcept;
  /// Whether a place is inside of which this is the closest point.
  bool is_inside(const Vec3& p_S, int triangle, const Vec3& closest_S) const noexcept;
  const TriangleMesh& border() const;  ///< what has not the inside on both sides
  bool has_inner() const;              ///< whether something has
  int triangle_of_border(int triangle) const;

 private:
  class Cells;
  std::unique_ptr<const Cells> cells_;
};

}  // namespace tandem::geometry
