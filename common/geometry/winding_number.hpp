// How often a surface goes around a point: what is inside a surface that has holes, inner walls or crosses itself.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// The generalised winding number of triangles that mostly face outwards: 1 inside a closed surface, 0 outside, between
/// them near a hole; more where solids overlap.
///
/// Model   w(p) = Σ Ω(p) / 4π, Ω the solid angle of each triangle. Of triangles together that are farther than kFar of
///         their radius: with r from p to their middle c, d from c to a point of them and n their normal,
///         Ω = ∫ F·n dA, F = (r + d) / |r + d|³ as its series in d up to the second order, whose coefficients are the
///         moments ∫ n dA, ∫ n d dA and ∫ n d d dA of each node
/// Source  Jacobson, Kavan & Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers",
///         2013; Barill et al., "Fast winding numbers for soups and clouds", 2018, eq. 8 to 14; solid angle: Van Oosterom
///         & Strackee, "The solid angle of a plane triangle", 1983
/// Cost    some microseconds; 100 bytes a piece and its share of the tree. A long triangle is near to much, and what is near is summed
///         one by one: so triangles much longer than most are wide are divided first, into up to kPieces times as many
/// Thread  any, at the same time; a query allocates nothing
class WindingNumber {
 public:
  static constexpr double kTolerance = 0.01;

  explicit WindingNumber(const TriangleMesh& mesh);
  WindingNumber(WindingNumber&& other) noexcept;
  WindingNumber& operator=(WindingNumber&& other) noexcept;
  ~WindingNumber();

  /// In      without  a triangle that does not count, with p in its plane, or −1: in the middle of one, what the others make there
  /// Out     lies_on  whether p is on a triangle that counts, or within about a thousandth of the size of its piece: what that one
  ///         makes there hangs on rounding; each within kTolerance
  double at(const Vec3& p_S, int without = -1, bool* lies_on = nullptr) const noexcept;

 private:
  static constexpr double kFar = 2;
  static constexpr std::uint32_t kLeafPieces = 6;
  static constexpr std::size_t kPieces = 3, kMinToDivide = 500;  ///< of fewer triangles each may be near
  static constexpr double kOnShare = 1e-3;

  using Piece = std::pair<std::array<Vec3, 3>, std::uint32_t>;  ///< its corners, and the triangle that it is of
  struct Node;
  struct AngleSum;

  void build(std::uint32_t first, std::uint32_t count);
  static void add_moments(Node& node, const Piece& piece);
  static void add_moments(Node& node, const Node& child);
  static double far_angle(const Node& node, const Vec3& r, double squared) noexcept;
  /// Half of its solid angle. Out: whether the point lies on it.
  static bool add_angle(const std::array<Vec3, 3>& corners, const Vec3& p_S, AngleSum& sum) noexcept;

  std::vector<Piece> pieces_;
  std::vector<Node> nodes_;
};

}  // namespace tandem::geometry
