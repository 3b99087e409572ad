#include "common/contact/shell/shell_motion.hpp"

#include <algorithm>

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {
namespace {

// Returns the radius of a ball around the shape, centred at the middle of its box. The box contains the shell's points.
// The surface may extend beyond the box by less than one spacing, which is added.
double radius_of(const ContactShape& shape) {
  return (shape.high_S - shape.low_S).norm() / 2 + shape.shells.surface.spacing_m;
}

double chord(const Quat& a, const Quat& b) {
  return 2 * (a.conjugate() * b).vec().norm();
}

}  // namespace

void ShellMotion::bind(const ContactShape& points, const ContactShape& solid) noexcept {
  points_centre_P_ = (points.low_S + points.high_S) / 2;
  points_radius_m_ = radius_of(points);
  solid_centre_F_ = (solid.low_S + solid.high_S) / 2;
  solid_radius_m_ = radius_of(solid);
  gap_m_ = -1;
}

void ShellMotion::move(const Pose& X_FP) noexcept {
  const Eigen::Matrix3d R_before = R_FP_;
  const Vec3 p_before = X_FP_.p;
  R_FP_ = X_FP.q.toRotationMatrix();
  turned_ = chord(X_FP_.q, X_FP.q);
  X_FP_ = X_FP;
  const Vec3 solid_P = R_FP_.transpose() * (solid_centre_F_ - X_FP_.p);
  const Vec3 solid_before_P = R_before.transpose() * (solid_centre_F_ - p_before);
  solid_moved_m_ = (solid_P - solid_before_P).norm() + turned_ * solid_radius_m_;
  turn_ = R_FP_ - R_before;
  shift_ = X_FP_.p - p_before;
}

double ShellMotion::moved_m(const ShellNode& node) const noexcept {
  const double of_points = (turn_ * node.centre_S.cast<double>() + shift_).norm() + turned_ * node.radius_m;
  return std::min(of_points, solid_moved_m_);
}

bool ShellMotion::is_out_of_reach(const Pose& X_FP, double band_m) const noexcept {
  if (gap_m_ < 0) return false;
  const double motion =
      (X_FP * points_centre_P_ - X_FP_gap_ * points_centre_P_).norm() + chord(X_FP_gap_.q, X_FP.q) * points_radius_m_;
  return motion + band_m <= gap_m_;
}

void ShellMotion::set_gap(double gap_m) noexcept {
  gap_m_ = gap_m;
  X_FP_gap_ = X_FP_;
}

}  // namespace tandem::contact
