// Motion of a shell (frame P) relative to a field (frame F), as an upper bound of the change of all distances.
#pragma once

#include "common/base/spatial.hpp"
#include "common/contact/points/point_shell.hpp"

namespace tandem::contact {

struct ContactShape;

/// Pose of the points in the field's frame, their motion in the last step, and the gap between shapes that are far
/// apart.
///
/// Model   The change of any distance is bounded by two motions: that of the points in the field's frame, and that of
///         the solid in the points' frame. The smaller one is used. For example, when a small tool turns above a large
///         table, the points of the table move far in the tool's frame, but the tool moves little in the table's frame.
///         A rotation by the quaternion q moves a point at the distance r from the centre by at most 2 |vec(q)| r
/// Thread  any, one at a time; no allocation
class ShellMotion {
 public:
  /// In      solid  shape that owns the field
  void bind(const ContactShape& points, const ContactShape& solid) noexcept;

  /// Sets the pose of this step. moved_m() then returns the motion since the previous call.
  void move(const Pose& X_FP) noexcept;
  /// Returns an upper bound of the change of the distances of a node's points in the last move().
  double moved_m(const ShellNode& node) const noexcept;

  /// Returns true if the stored gap proves that every point is at least `band_m` away from the solid's surface at this
  /// pose.
  bool is_out_of_reach(const Pose& X_FP, double band_m) const noexcept;
  /// Stores a lower bound of all distances at the current pose. A negative value means that it is unknown.
  void set_gap(double gap_m) noexcept;

  const Pose& X_FP() const { return X_FP_; }
  const Eigen::Matrix3d& R_FP() const { return R_FP_; }
  const Vec3& p_FP() const { return X_FP_.p; }
  Vec3 in_field(const Eigen::Vector3f& p_P) const { return R_FP_ * p_P.cast<double>() + X_FP_.p; }
  const Vec3& solid_centre_F() const { return solid_centre_F_; }
  double solid_radius_m() const { return solid_radius_m_; }

 private:
  Vec3 points_centre_P_ = Vec3::Zero();  ///< centre of a ball around the shell's points
  double points_radius_m_ = 0;
  Vec3 solid_centre_F_ = Vec3::Zero();  ///< centre of a ball around the solid
  double solid_radius_m_ = 0;
  Pose X_FP_;
  Eigen::Matrix3d R_FP_ = Eigen::Matrix3d::Identity();

  // The following members describe the last move().
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Zero();  ///< change of R_FP
  Vec3 shift_ = Vec3::Zero();                       ///< change of p_FP
  double turned_ = 0;         ///< motion of a point by the rotation, per distance from the centre: upper bound
  double solid_moved_m_ = 0;  ///< motion of the solid relative to the points

  double gap_m_ = -1;  ///< lower bound of all distances at X_FP_gap_; negative: unknown
  Pose X_FP_gap_;
};

}  // namespace tandem::contact
