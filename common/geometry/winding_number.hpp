// Winding number of a surface around a point. It classifies inside and outside even if the surface has holes or inner
// walls, or crosses itself.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Generalised winding number of triangles that mostly face outwards. It is 1 inside a closed surface, 0 outside,
/// between 0 and 1 near a hole, and larger where solids overlap.
///
/// Model   The winding number at the point p is w(p) = Σ Ω / 4π, where Ω is the solid angle of each triangle seen from
///         p. For a group of triangles whose distance exceeds kFar times its radius, Ω is approximated:
///         * r: vector from p to the group's centre c; d: vector from c to a point of the group; n: normal at that
///           point.
///         * Ω = ∫ F·n dA with F = (r + d) / |r + d|³. F is expanded as a series in d up to second order.
///         * The coefficients of the series are the moments ∫ n dA, ∫ n d dA and ∫ n d d dA, which each node stores
/// Source  Jacobson, Kavan & Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers",
///         2013; Barill et al., "Fast winding numbers for soups and clouds", 2018, eq. 8 to 14; solid angle: Van
///         Oosterom & Strackee, "The solid angle of a plane triangle", 1983
/// Cost    some microseconds per query; 100 bytes of memory per piece, and the nodes of the tree. Triangles near the
///         query point are summed one by one, and long triangles are near many points. They are therefore divided into
///         pieces: at most kPieces times as many as there are triangles
/// Thread  any number of threads at the same time; a query allocates nothing
class WindingNumber {
 public:
  static constexpr double kTolerance = 0.01;

  explicit WindingNumber(const TriangleMesh& mesh);
  WindingNumber(WindingNumber&& other) noexcept;
  WindingNumber& operator=(WindingNumber&& other) noexcept;
  ~WindingNumber();

  /// Returns the winding number at a point, accurate to kTolerance.
  ///
  /// In      excluded_triangle  triangle to exclude; −1: none. p must be in its plane. At the middle of this triangle,
  ///         the result is the winding number of all other triangles
  /// Out     lies_on  true: p is on a triangle that is not excluded, or nearer to it than about 1/1000 of its size. Its
  ///         contribution then depends on rounding
  double at(const Vec3& p_S, int excluded_triangle = -1, bool* lies_on = nullptr) const noexcept;

 private:
  static constexpr double kFar = 2;
  static constexpr std::uint32_t kLeafPieces = 6;
  /// Meshes with fewer than kMinToDivide triangles are not divided into pieces. Larger meshes get at most kPieces times
  /// as many pieces as triangles.
  static constexpr std::size_t kPieces = 3, kMinToDivide = 500;
  static constexpr double kOnShare = 1e-3;

  /// Corners of a piece, and the index of the triangle to which it belongs.
  using Piece = std::pair<std::array<Vec3, 3>, std::uint32_t>;
  struct Node;
  struct AngleSum;

  void build(std::uint32_t first, std::uint32_t count);
  static void add_moments(Node& node, const Piece& piece);
  static void add_moments(Node& node, const Node& child);
  static double far_angle(const Node& node, const Vec3& r, double squared) noexcept;
  /// Adds half the solid angle of a triangle to `sum`. Returns whether the point lies on the triangle.
  static bool add_angle(const std::array<Vec3, 3>& corners, const Vec3& p_S, AngleSum& sum) noexcept;

  std::vector<Piece> pieces_;
  std::vector<Node> nodes_;
};

}  // namespace tandem::geometry
