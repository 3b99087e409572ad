// Contact with a union of shapes: a surface that another shape of the union covers has no contact.
#pragma once

#include <optional>
#include <span>

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {

struct ContactPoint;

/// Other shapes affect a contact only within this distance: twice the largest rigid depth (depth beyond which contact
/// is as stiff as the step allows).
inline constexpr double kUnionReach_m = 2 * kMaxRigidDepth;

/// A shape with its pose in the world.
struct PlacedShape {
  const ContactShape* shape = nullptr;
  Pose X_WS;
};

/// Union of one shape of a pair ("own shape") with other shapes beside it that are near the second shape of the pair.
///
/// Model   A pressing contact pushes its point p out of the shape to the surface point q = p + depth × normal. If
///         another shape covers q, then q is inside the union and p must move elsewhere. Two displacements are
///         computed, and the shorter one is used:
///         1. out of the same shape through another face
///         2. through q, and from there out of the covering shape
///         A covered face is nearest to p, so the other faces are found from samples farther inside the shape. The
///         result is exact for flat faces. At the border between covered and free surface, both results are
///         interpolated over 20 µm (more for meshes), so that forces do not jump
/// Thread  any; no allocation
class ShapeUnion {
 public:
  ShapeUnion(const PlacedShape& own, std::span<const PlacedShape> others) : own_(own), others_(others) {}

  bool has_others() const { return !others_.empty(); }

  /// Corrects a contact whose depth and normal were computed in the field of the union's own shape.
  ///
  /// In      out_W  unit vector out of that shape
  /// Out     depth, normal and area of the contact
  void correct_depth(ContactPoint& contact, const Vec3& out_W) const noexcept;

  /// Returns the degree, 0 to 1, to which other shapes cover this union's own shape at a surface point. An edge that is
  /// flush with the surface of another shape counts as covered.
  double covered_share(const Vec3& p_W, const Vec3& normal_W) const noexcept;

 private:
  struct Cover;

  Cover cover_of(const PlacedShape& leaving, const Vec3& q_W, const Vec3& out_W) const noexcept;
  void correct_gap(ContactPoint& contact, const Vec3& out_W) const noexcept;
  std::optional<Vec3> way_out(const PlacedShape& shape, const Vec3& p_W, Vec3 inward_W) const noexcept;

  PlacedShape own_;
  std::span<const PlacedShape> others_;
};

/// Moves the shapes that are near the contacts to the front of `shapes`, in unchanged order, and returns their number.
/// The remaining entries become invalid.
std::size_t keep_near(std::span<PlacedShape> shapes, std::span<const ContactPoint> contacts) noexcept;

}  // namespace tandem::contact
