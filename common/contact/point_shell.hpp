// A surface as points: what is asked of the other shape's distance field.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/contact/distance_field.hpp"
#include "common/contact/flat/flat_node.hpp"
#include "common/geometry/mesh_repair.hpp"

namespace tandem::contact {

/// One sample of a surface, in the frame of its shape S. Single precision: 10 cm to 10 nm.
struct ShellPoint {
  Eigen::Vector3f p_S = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_S = Eigen::Vector3f::Zero();  ///< out of the shape, unit
  float area_m2 = 0;                                   ///< its share of the surface; all shares sum to the surface
};

/// A ball around points first .. first + count − 1, and around all nodes below it.
struct ShellNode {
  Eigen::Vector3f centre_S = Eigen::Vector3f::Zero();
  float radius_m = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  std::uint32_t next = 0;  ///< index of the node to go on with when this one is left out; node + 1 is its first child
  std::uint32_t flat = kNotFlat;  ///< index in PointShell::flat_nodes
  bool is_leaf = false;
  /// All its points as one, on the surface as they are: used where work must be bounded.
  ShellPoint mean;

  static constexpr std::uint32_t kNotFlat = 0xffffffff;
};

/// The most points below a leaf.
inline constexpr std::uint32_t kShellLeafPoints = 8;

/// Points in the order of the tree over them (depth first), so that neighbours in space are neighbours in memory.
struct PointShell {
  std::vector<ShellPoint> points;
  std::vector<ShellNode> nodes;  ///< node 0 is the root; empty without points
  std::vector<FlatNode> flat_nodes;
  double spacing_m = 0;  ///< no point of the surface is farther than this from a shell point

  /// Builds the tree over `points`, which it puts in order.
  static PointShell of(std::vector<ShellPoint> points, double spacing_m);

  /// The same of points that are in that order already.
  static PointShell in_order(std::vector<ShellPoint> points, double spacing_m);

  double area_m2() const;
  std::size_t memory_bytes() const;
  /// The points, as coarsely as contact_asset_bytes() says; the tree follows from them.
  void write(std::vector<std::uint8_t>& bytes, int packing_level) const;
  /// Nothing for anything that write() did not write, or for more memory than `limit_bytes`: counts and numbers are
  /// checked.
  static std::optional<PointShell> read(std::span<const std::uint8_t>& bytes, std::size_t limit_bytes);
};

/// Both shells of a surface.
struct PointShells {
  PointShell surface;   ///< everything, features included
  PointShell features;  ///< sharp edges, corners and small bumps alone; may be empty
};

struct ContactShapeOptions;

/// Deterministic: the same mesh gives the same points.
PointShells sample_surface(const geometry::ContactMesh& mesh, const ContactShapeOptions& options,
                           const std::function<void(double)>& progress);
/// Of a primitive: `outline` is its tessellation, `field` its exact distance, on whose surface the points are put.
PointShells sample_surface(const geometry::TriangleMesh& outline, const DistanceField& field,
                           const ContactShapeOptions& options);

}  // namespace tandem::contact
