#include "common/contact/field/primitive_fields.hpp"

#include <array>
#include <limits>

#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {
namespace {

/// Returns `a` as a unit vector, or `otherwise` if `a` is zero.
Vec3 direction_or(const Vec3& a, const Vec3& otherwise) {
  const double length = a.norm();
  return length > 0 ? Vec3(a / length) : otherwise;
}

/// Cylindrical coordinates of a point: its distance from the z axis, and the direction away from the axis.
struct Radial {
  explicit Radial(const Vec3& p) : radius_m(std::hypot(p.x(), p.y())) {
    if (radius_m > 0) outward = Vec3(p.x() / radius_m, p.y() / radius_m, 0);
  }
  double radius_m;
  Vec3 outward = Vec3::UnitX();  ///< away from the axis; arbitrary for a point on the axis
};

/// Returns the signed distance to the intersection of two perpendicular regions, from the distances to each. If both
/// are positive, it is the distance to the corner; otherwise, it is the larger one.
double distance_to_corner(double a, double b) {
  if (a > 0 && b > 0) return std::hypot(a, b);
  return std::max(a, b);
}

/// Returns whether holds(p) is true for all corners of a box. If the region in which it is true is convex, it is true
/// in the whole box.
template <typename Holds>
bool all_corners(const OrientedBox& box, const Holds& holds) {
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1);
    if (!holds(Vec3(box.centre + box.axes * sign.cwiseProduct(box.half_m)))) return false;
  }
  return true;
}

class HalfSpaceField final : public ExactField {
 public:
  double distance_m(const Vec3& p_S) const noexcept override { return p_S.z(); }
  DistanceSample sample(const Vec3& p_S) const noexcept override { return {p_S.z(), Vec3::UnitZ()}; }
  std::span<const FieldPlane> planes() const noexcept override { return {&plane_, 1}; }
  PlaneSet planes_over(const OrientedBox& /*box_S*/, std::size_t& queries) const noexcept override {
    ++queries;
    return 1;
  }
  PlaneSet planes_at(const Vec3& /*p_S*/) const noexcept override { return 1; }

 private:
  FieldPlane plane_{Vec3::UnitZ(), 0};
};

class SphereField final : public ExactField {
 public:
  explicit SphereField(double radius_m) : radius_m_(radius_m) {}
  double distance_m(const Vec3& p_S) const noexcept override { return p_S.norm() - radius_m_; }
  DistanceSample sample(const Vec3& p_S) const noexcept override {
    return {p_S.norm() - radius_m_, direction_or(p_S, Vec3::UnitZ())};
  }

 private:
  double radius_m_;
};

class BoxField final : public ExactField {
 public:
  explicit BoxField(const Vec3& size_m) : half_m_(size_m / 2) {
    for (int axis = 0; axis < 3; ++axis) {
      planes_[2 * static_cast<std::size_t>(axis)] = {-Vec3::Unit(axis), -half_m_[axis]};
      planes_[2 * static_cast<std::size_t>(axis) + 1] = {Vec3::Unit(axis), -half_m_[axis]};
    }
  }
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;
  std::span<const FieldPlane> planes() const noexcept override { return planes_; }
  PlaneSet planes_over(const OrientedBox& /*box_S*/, std::size_t& queries) const noexcept override {
    ++queries;
    return (PlaneSet{1} << planes_.size()) - 1;
  }
  PlaneSet planes_at(const Vec3& /*p_S*/) const noexcept override { return (PlaneSet{1} << planes_.size()) - 1; }

 private:
  Vec3 half_m_;
  std::array<FieldPlane, 6> planes_;  ///< the lower and the upper face for each axis in turn
};

class CylinderField final : public ExactField {
 public:
  CylinderField(double radius_m, double length_m)
      : radius_m_(radius_m),
        half_length_m_(length_m / 2),
        ends_{{{-Vec3::UnitZ(), -half_length_m_}, {Vec3::UnitZ(), -half_length_m_}}} {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;
  std::span<const FieldPlane> planes() const noexcept override { return ends_; }
  PlaneSet planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept override;
  PlaneSet planes_at(const Vec3& p_S) const noexcept override {
    std::size_t queries = 0;
    return planes_over({p_S}, queries);
  }

 private:
  double radius_m_;
  double half_length_m_;
  std::array<FieldPlane, 2> ends_;
};

class CapsuleField final : public ExactField {
 public:
  CapsuleField(double radius_m, double length_m) : radius_m_(radius_m), half_length_m_(length_m / 2) {}
  double distance_m(const Vec3& p_S) const noexcept override;
  DistanceSample sample(const Vec3& p_S) const noexcept override;

 private:
  double radius_m_;
  double half_length_m_;
};

double BoxField::distance_m(const Vec3& p_S) const noexcept {
  const Vec3 beyond = p_S.cwiseAbs() - half_m_;
  const double nearest = beyond.maxCoeff();
  return nearest > 0 ? beyond.cwiseMax(0.0).norm() : nearest;
}

DistanceSample BoxField::sample(const Vec3& p_S) const noexcept {
  const Vec3 beyond = p_S.cwiseAbs() - half_m_;
  int axis = 0;
  const double nearest = beyond.maxCoeff(&axis);
  DistanceSample sample{nearest, Vec3::Zero()};
  sample.gradient[axis] = std::copysign(1.0, p_S[axis]);
  if (nearest <= 0) return sample;
  const Vec3 outside = beyond.cwiseMax(0.0);
  sample.distance_m = outside.norm();
  const Vec3 way(std::copysign(outside.x(), p_S.x()), std::copysign(outside.y(), p_S.y()),
                 std::copysign(outside.z(), p_S.z()));
  // The distance may be 0 although the point is outside, because squares of lengths below 1e-162 m underflow. In this
  // case the gradient keeps its default direction.
  if (sample.distance_m > 0) sample.gradient = way / sample.distance_m;
  return sample;
}

double CylinderField::distance_m(const Vec3& p_S) const noexcept {
  return distance_to_corner(std::hypot(p_S.x(), p_S.y()) - radius_m_, std::abs(p_S.z()) - half_length_m_);
}

DistanceSample CylinderField::sample(const Vec3& p_S) const noexcept {
  const Radial radial(p_S);
  const double beyond_side = radial.radius_m - radius_m_;
  const double beyond_end = std::abs(p_S.z()) - half_length_m_;
  const Vec3 axial(0, 0, std::copysign(1.0, p_S.z()));
  const double distance = distance_to_corner(beyond_side, beyond_end);
  const Vec3 nearest = beyond_side > beyond_end ? radial.outward : axial;
  if (beyond_side <= 0 || beyond_end <= 0) return {distance, nearest};
  return {distance, direction_or(beyond_side * radial.outward + beyond_end * axial, nearest)};
}

PlaneSet CylinderField::planes_over(const OrientedBox& box_S, std::size_t& queries) const noexcept {
  ++queries;
  const bool is_above = box_S.centre.z() > 0;
  const bool is_over = all_corners(box_S, [&](const Vec3& p) {
    if ((p.z() > 0) != is_above) return false;
    const double beyond_side = std::hypot(p.x(), p.y()) - radius_m_;
    return beyond_side <= std::min(0.0, std::abs(p.z()) - half_length_m_);
  });
  if (!is_over) return 0;
  return is_above ? 2 : 1;
}

double CapsuleField::distance_m(const Vec3& p_S) const noexcept {
  const double along = std::clamp(p_S.z(), -half_length_m_, half_length_m_);
  return (p_S - Vec3(0, 0, along)).norm() - radius_m_;
}

DistanceSample CapsuleField::sample(const Vec3& p_S) const noexcept {
  const double along = std::clamp(p_S.z(), -half_length_m_, half_length_m_);
  const Vec3 from_axis = p_S - Vec3(0, 0, along);
  return {from_axis.norm() - radius_m_, direction_or(from_axis, Vec3::UnitX())};
}

}  // namespace

double ExactField::band_m() const noexcept {
  return std::numeric_limits<double>::infinity();
}

std::unique_ptr<ExactField> half_space_field() {
  return std::make_unique<HalfSpaceField>();
}

std::unique_ptr<ExactField> sphere_field(double radius_m) {
  return std::make_unique<SphereField>(radius_m);
}

std::unique_ptr<ExactField> box_field(const Vec3& size_m) {
  return std::make_unique<BoxField>(size_m);
}

std::unique_ptr<ExactField> cylinder_field(double radius_m, double length_m) {
  return std::make_unique<CylinderField>(radius_m, length_m);
}

std::unique_ptr<ExactField> capsule_field(double radius_m, double length_m) {
  return std::make_unique<CapsuleField>(radius_m, length_m);
}

}  // namespace tandem::contact
