// A surface represented by points. The contact search samples these points in the distance field of the other shape of
// a pair.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/flat_node.hpp"
#include "common/geometry/mesh_repair.hpp"

namespace tandem::contact {

/// One sample of a surface, in the frame of its shape S. Single precision resolves 10 nm at 10 cm from the origin.
struct ShellPoint {
  Eigen::Vector3f p_S = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_S = Eigen::Vector3f::Zero();  ///< unit vector out of the shape
  /// Area of surface that the point represents. The areas of all points sum to the area of the surface.
  float area_m2 = 0;
};

/// A node of the tree: a ball around the points first … first + count − 1. Its children contain the same points.
struct ShellNode {
  Eigen::Vector3f centre_S = Eigen::Vector3f::Zero();
  float radius_m = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  std::uint32_t next = 0;         ///< index of the node after this subtree; node + 1 is the first child
  std::uint32_t flat = kNotFlat;  ///< index in PointShell::flat_nodes
  bool is_leaf = false;
  /// One point with the total area of the node's points. It is at their mean, or at the point nearest to the mean if
  /// they are not on a plane. The search uses it instead of the points if there are too many.
  ShellPoint mean;

  static constexpr std::uint32_t kNotFlat = 0xffffffff;
};

/// Largest number of points in a leaf.
inline constexpr std::uint32_t kShellLeafPoints = 8;

/// Points in depth-first order of the tree over them, so that neighbours in space are neighbours in memory.
struct PointShell {
  std::vector<ShellPoint> points;
  std::vector<ShellNode> nodes;  ///< node 0 is the root; empty without points
  std::vector<FlatNode> flat_nodes;
  double spacing_m = 0;  ///< maximum distance from any point of the surface to the nearest shell point

  /// Sorts `points` and builds the tree over them.
  static PointShell make(std::vector<ShellPoint> points, double spacing_m);

  /// Builds the same tree over points that make() has sorted before.
  static PointShell in_order(std::vector<ShellPoint> points, double spacing_m);

  double area_m2() const;
  std::size_t memory_bytes() const;
  /// Writes the points with the resolution of contact_asset_bytes(). The tree is not written, since the points
  /// determine it.
  void write(std::vector<std::uint8_t>& bytes, int packing_level) const;
  /// Reads bytes that write() wrote. Returns nothing for any other bytes, or if the shell needs more memory than
  /// `limit_bytes`. Counts and numbers are checked.
  static std::optional<PointShell> read(std::span<const std::uint8_t>& bytes, std::size_t limit_bytes);
};

/// The two shells of a shape's surface.
struct PointShells {
  PointShell surface;   ///< the whole surface, including the features
  PointShell features;  ///< points on sharp edges, corners and small bumps only; may be empty
};

struct ContactShapeOptions;

/// Samples the surface of a mesh. The same mesh always gives the same points.
PointShells sample_surface(const geometry::ContactMesh& mesh, const ContactShapeOptions& options,
                           const std::function<void(double)>& progress);
/// Samples the surface of a primitive. `outline` is the primitive's tessellation, and `field` its exact distance field.
/// Samples of the tessellation are projected onto the field's surface.
PointShells sample_surface(const geometry::TriangleMesh& outline, const DistanceField& field,
                           const ContactShapeOptions& options);

}  // namespace tandem::contact
