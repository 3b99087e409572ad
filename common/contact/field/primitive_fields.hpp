// Exact distance fields of primitives, by formula.
#pragma once

#include <memory>

#include "common/contact/field/distance_field.hpp"

namespace tandem::contact {

/// Common base of the fields of primitives. Their distances are exact everywhere, and the shapes are convex.
class ExactField : public DistanceField {
 public:
  double error_m() const noexcept override { return 0; }
  double band_m() const noexcept override;
};

/// Returns the field of the half-space z ≤ 0.
std::unique_ptr<ExactField> half_space_field();
std::unique_ptr<ExactField> sphere_field(double radius_m);
/// In      size_m  full edge lengths
std::unique_ptr<ExactField> box_field(const Vec3& size_m);
/// Returns the field of a cylinder centred at the origin, with its axis along z.
std::unique_ptr<ExactField> cylinder_field(double radius_m, double length_m);
/// Returns the field of a capsule centred at the origin, with its axis along z. `length_m` is the length of the part
/// between the round ends.
std::unique_ptr<ExactField> capsule_field(double radius_m, double length_m);

}  // namespace tandem::contact
