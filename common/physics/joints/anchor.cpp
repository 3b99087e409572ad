#include "common/physics/joints/anchor.hpp"

#include <Eigen/Cholesky>

namespace tandem::physics {
namespace {

/// Velocity of the point at `r` from the centre, from that of the centre.
Mat6 to_point(const Vec3& r) {
  Mat6 J = Mat6::Identity();
  J.topRightCorner<3, 3>() << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
  return J;
}

Mat6 blocks(const Eigen::Matrix3d& linear, const Eigen::Matrix3d& angular) {
  Mat6 result = Mat6::Zero();
  result.topLeftCorner<3, 3>() = linear;
  result.bottomRightCorner<3, 3>() = angular;
  return result;
}

Vec6 stacked(const Vec3& linear, const Vec3& angular) {
  return (Vec6() << linear, angular).finished();
}

}  // namespace

Wrench anchor_wrench_W(const RigidBody& body, const Pose& X_target, const Joint& joint, const Wrench& wrench_W,
                       double step_s) noexcept {
  const RigidState now = body.state();
  const Twist& V_WC = body.velocity_of_centre_W();
  const Mat6 J = to_point(now.X.p - body.centre_W());
  JointLaw law;
  law.set(joint);
  const haptics::CouplingGradient slopes = law.gradient({});
  const Mat6 K = blocks(slopes.force_by_d, slopes.torque_by_theta);
  const Mat6 D = blocks(slopes.force_by_v, slopes.torque_by_w);
  const Mat6 M = blocks(body.mass().mass_kg * Eigen::Matrix3d::Identity(), body.inertia_W());
  const Vec6 e = stacked(now.X.p - X_target.p, rotation_vector(now.X.q * X_target.q.conjugate()));
  const Vec6 w = stacked(wrench_W.f, wrench_W.t);
  const Vec6 V = stacked(V_WC.v, V_WC.w);
  const Mat6 A = M + J.transpose() * (step_s * D + step_s * step_s * K) * J;
  const Vec6 b = M * V + step_s * w - step_s * (J.transpose() * (K * e));
  const Vec6 V_next = A.llt().solve(b);
  const Vec6 done = -(J.transpose() * (K * (e + step_s * (J * V_next)) + D * (J * V_next)));
  if (!done.allFinite()) return {};
  return {done.head<3>(), done.tail<3>()};
}

}  // namespace tandem::physics
