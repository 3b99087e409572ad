// Winding number of a surface around a point: classifies inside and outside of a surface with holes, inner walls or
// self-crossings.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Generalised winding number of triangles that mostly face outwards. It is 1 inside a closed surface, 0 outside,
/// between them near a hole, and larger where solids overlap.
///
/// Model   w(p) = Σ Ω(p) / 4π, where Ω is the solid angle of each triangle. A group of triangles farther than kFar
///         times its radius is approximated. Let r go from p to the group's centre c, d from c to a point of the group,
///         and n be the normal there. Then Ω = ∫ F·n dA, with F = (r + d) / |r + d|³ as a series in d up to the second
///         order. Its coefficients are the moments ∫ n dA, ∫ n d dA and ∫ n d d dA of each node
/// Source  Jacobson, Kavan & Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers",
///         2013; Barill et al., "Fast winding numbers for soups and clouds", 2018, eq. 8 to 14; solid angle: Van
///         Oosterom & Strackee, "The solid angle of a plane triangle", 1983
/// Cost    some microseconds a query; 100 bytes a piece plus its share of the tree. Near triangles are summed one by
///         one, and a long triangle is near to many points. Long triangles are therefore divided first, into up to
///         kPieces times as many pieces
/// Thread  any, at the same time; a query allocates nothing
class WindingNumber {
 public:
  static constexpr double kTolerance = 0.01;

  explicit WindingNumber(const TriangleMesh& mesh);
  WindingNumber(WindingNumber&& other) noexcept;
  WindingNumber& operator=(WindingNumber&& other) noexcept;
  ~WindingNumber();

  /// Returns the winding number at a point, within kTolerance.
  ///
  /// In      excluded_triangle  a triangle that is excluded, with p in its plane, or −1. At the middle of a triangle
  ///         this gives the winding number of the others
  /// Out     lies_on  whether p lies on another triangle, or within about a thousandth of its piece's size. The
  ///         contribution of that triangle then depends on rounding
  double at(const Vec3& p_S, int excluded_triangle = -1, bool* lies_on = nullptr) const noexcept;

 private:
  static constexpr double kFar = 2;
  static constexpr std::uint32_t kLeafPieces = 6;
  static constexpr std::size_t kPieces = 3, kMinToDivide = 500;  ///< meshes with fewer triangles are not divided
  static constexpr double kOnShare = 1e-3;

  using Piece = std::pair<std::array<Vec3, 3>, std::uint32_t>;  ///< corners of the piece, and index of its triangle
  struct Node;
  struct AngleSum;

  void build(std::uint32_t first, std::uint32_t count);
  static void add_moments(Node& node, const Piece& piece);
  static void add_moments(Node& node, const Node& child);
  static double far_angle(const Node& node, const Vec3& r, double squared) noexcept;
  /// Adds half the solid angle of a triangle. Returns whether the point lies on the triangle.
  static bool add_angle(const std::array<Vec3, 3>& corners, const Vec3& p_S, AngleSum& sum) noexcept;

  std::vector<Piece> pieces_;
  std::vector<Node> nodes_;
};

}  // namespace tandem::geometry
