// A shape for contact: its distance field and its surface points. It is built once and then shared.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/contact/contact_shape_options.hpp"
#include "common/contact/field/distance_field.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/round/rod.hpp"
#include "common/geometry/mesh_repair.hpp"

namespace tandem::contact {

/// Immutable shape for contact. All bodies with this shape share one object, in all rooms of a server. Server and
/// clients have identical copies.
struct ContactShape {
  std::shared_ptr<const DistanceField> field;
  PointShells shells;
  /// Surface points that are not inside a flat part (a plane of the field), away from its edges. Inside flat parts, the
  /// search samples only the points of the other shape. Empty if all surface points must be sampled.
  std::optional<PointShell> off_planes;
  Vec3 low_S = Vec3::Zero();  ///< bounding box of the points
  Vec3 high_S = Vec3::Zero();
  /// Rigid depth: depth beyond which contact is as stiff as the step allows. It is less than half of the thickness of
  /// the shape's thin parts, so that a pressing point stops before the far side of a wall is nearer.
  double rigid_depth_m = 5e-4;
  double half_thickness_m = 1.25e-3;  ///< half thickness of the shape's thin parts; kMaxHalfThickness at most
  double ball_radius_m = 0;           ///< radius of the shape if it is one ball about the origin of S; 0: no ball
  Rod rod;                            ///< dimensions of the shape if it is a rod or a ball

  /// Returns an upper bound of the distance of the points from the origin of S.
  double radius_m() const { return std::max(low_S.norm(), high_S.norm()); }
  std::size_t memory_bytes() const;
  const PointShell& surface_off_planes() const { return off_planes ? *off_planes : shells.surface; }
  /// Computes bounds and `off_planes` from points and field.
  void complete();
};

/// Limit of the memory of one shape; shapes made with the default options need less.
inline constexpr std::size_t kMaxShapeBytes = std::size_t{128} << 20U;
/// Default compression level of zstd (range 1 to 22).
inline constexpr int kPackingLevel = 12;
inline constexpr double kMaxRigidDepth = 5e-4;
/// Limit up to which the half thickness is measured. In thicker parts, the rigid depth is kMaxRigidDepth anyway.
inline constexpr double kMaxHalfThickness = 1.25e-3;
/// Minimum of the rigid depth, even for very thin shapes. A hand that presses on a single contact reaches about five
/// times this depth.
inline constexpr double kMinRigidDepth = 5e-5;

std::shared_ptr<const ContactShape> make_contact_sphere(double radius_m, const ContactShapeOptions& options = {});
std::shared_ptr<const ContactShape> make_contact_box(const Vec3& size_m, const ContactShapeOptions& options = {});
std::shared_ptr<const ContactShape> make_contact_cylinder(double radius_m, double length_m,
                                                          const ContactShapeOptions& options = {});
std::shared_ptr<const ContactShape> make_contact_capsule(double radius_m, double length_m,
                                                         const ContactShapeOptions& options = {});
/// In      progress  called on the calling thread from time to time with the completed fraction, 0..1; may be empty
/// Fails   MeshError: too large for the grid's cells, or so far from its origin that single precision is too coarse;
///         std::invalid_argument: an option out of its range
std::shared_ptr<const ContactShape> make_contact_mesh(const geometry::ContactMesh& mesh,
                                                      const ContactShapeOptions& options = {},
                                                      const std::function<void(double)>& progress = {});

/// Serialises a mesh's shape for the disk cache and for clients. The bytes are little-endian, versioned and compressed.
/// Rounding changes distances near the surface by at most 1/32 of the tolerance (1 µm by default). Points change by at
/// most 1/512 of the spacing along each axis, and normals by at most 0.1°. make_contact_mesh() rounds in the same way,
/// so server and clients have bitwise identical shapes.
///
/// In      packing_level  level of zstd; 0: not compressed
std::vector<std::uint8_t> contact_asset_bytes(const ContactShape& shape, int packing_level = kPackingLevel);
/// Reads a shape from the result of contact_asset_bytes(). Returns null if the bytes are not a whole asset of this
/// version, or if the shape needs more memory than `limit_bytes`. Malicious bytes are safe: reading them uses at most
/// four times `limit_bytes` of memory, and no more time than filling this memory takes.
std::shared_ptr<const ContactShape> contact_shape_from(std::span<const std::uint8_t> bytes,
                                                       std::size_t limit_bytes = kMaxShapeBytes);
/// Serialises the inputs from which a mesh's asset is built (mesh, options and version). A hash of these bytes can be
/// the key of a cache.
std::vector<std::uint8_t> contact_asset_origin(const geometry::ContactMesh& mesh, const ContactShapeOptions& options);
/// Version of the asset's bytes. Increment it whenever the same mesh would give different bytes.
inline constexpr std::uint32_t kContactAssetVersion = 10;

}  // namespace tandem::contact
