#include "common/physics/joints/anchor.hpp"

#include <Eigen/Cholesky>

namespace tandem::physics {
namespace {

using Matrix = Eigen::Matrix<double, 6, 6>;
using Vector = Eigen::Matrix<double, 6, 1>;

/// Velocity of the point at `r` from the centre, from that of the centre.
Matrix to_point(const Vec3& r) {
  Matrix J = Matrix::Identity();
  J.topRightCorner<3, 3>() << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
  return J;
}

Matrix blocks(const Eigen::Matrix3d& linear, const Eigen::Matrix3d& angular) {
  Matrix result = Matrix::Zero();
  result.topLeftCorner<3, 3>() = linear;
  result.bottomRightCorner<3, 3>() = angular;
  return result;
}

Vector stacked(const Vec3& linear, const Vec3& angular) {
  return (Vector() << linear, angular).finished();
}

}  // namespace

Wrench anchor_wrench_W(const RigidBody& body, const Pose& X_target, const Joint& joint, const Wrench& wrench_W,
                       double step_s) noexcept {
  const RigidState now = body.state();
  const Twist& V_WC = body.velocity_of_centre_W();
  const Matrix J = to_point(now.X.p - body.centre_W());
  JointLaw law;
  law.set(joint, 1);
  const haptics::CouplingGradient slopes = law.gradient({});
  const Matrix K = blocks(slopes.force_by_d, slopes.torque_by_theta);
  const Matrix D = blocks(slopes.force_by_v, slopes.torque_by_w);
  const Matrix M = blocks(body.mass().mass_kg * Eigen::Matrix3d::Identity(), body.inertia_W());
  const Vector e = stacked(now.X.p - X_target.p, rotation_vector(now.X.q * X_target.q.conjugate()));
  const Vector w = stacked(wrench_W.f, wrench_W.t);
  const Vector V = stacked(V_WC.v, V_WC.w);
  const Matrix A = M + J.transpose() * (step_s * D + step_s * step_s * K) * J;
  const Vector b = M * V + step_s * w - step_s * (J.transpose() * (K * e));
  const Vector V_next = A.llt().solve(b);
  const Vector done = -(J.transpose() * (K * (e + step_s * (J * V_next)) + D * (J * V_next)));
  if (!done.allFinite()) return {};
  return {done.head<3>(), done.tail<3>()};
}

}  // namespace tandem::physics
