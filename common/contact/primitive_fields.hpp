// Exact distances of the shapes that have a formula.
#pragma once

#include "common/contact/distance_field.hpp"

namespace tandem::contact {

/// What they have in common: exact everywhere, and convex.
class ExactField : public DistanceField {
 public:
  double error_m() const noexcept override { return 0; }
  double band_m() const noexcept override;
};

/// All that is below z = 0.
class HalfSpaceField final : public ExactField {
 public:
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;
};

class SphereField final : public ExactField {
 public:
  explicit SphereField(double radius_m) : radius_m_(radius_m) {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;

 private:
  double radius_m_;
};

class BoxField final : public ExactField {
 public:
  /// In      size_m  full edge lengths
  explicit BoxField(const Vec3& size_m) : half_m_(size_m / 2) {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;

 private:
  Vec3 half_m_;
};

/// Axis z, centred.
class CylinderField final : public ExactField {
 public:
  CylinderField(double radius_m, double length_m) : radius_m_(radius_m), half_length_m_(length_m / 2) {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;

 private:
  double radius_m_;
  double half_length_m_;
};

/// Axis z, centred; `length_m` of the straight part.
class CapsuleField final : public ExactField {
 public:
  CapsuleField(double radius_m, double length_m) : radius_m_(radius_m), half_length_m_(length_m / 2) {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;

 private:
  double radius_m_;
  double half_length_m_;
};

}  // namespace tandem::contact
