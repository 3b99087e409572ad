// Poses, twists and wrenches: the 6-DOF types of the whole project, based on Eigen.
//
// Notation (a subset of monogram notation): X_AB is the pose of frame B measured in A, p_AB its position, v_AB and w_AB
// its linear and angular velocity. All vectors are expressed in the first-named frame (A) unless a suffix names a
// different frame. Frames: W world, D device base, H device handle, T tool, B body.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tandem {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;  ///< (f, t) for a wrench, (v, w) for a twist
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Quat = Eigen::Quaterniond;

/// A rigid pose X_AB: `p` is the position p_AB [m], `q` the unit quaternion that rotates from B to A.
struct Pose {
  Vec3 p = Vec3::Zero();
  Quat q = Quat::Identity();

  Vec3 operator*(const Vec3& point) const { return p + q * point; }
  Pose operator*(const Pose& X_BC) const { return {p + q * X_BC.p, (q * X_BC.q).normalized()}; }
  Pose inverse() const {
    const Quat inverse_q = q.conjugate();
    return {-(inverse_q * p), inverse_q};
  }
};

/// Velocity of a frame: `v` is the linear velocity of its origin [m/s], `w` its angular velocity [rad/s].
struct Twist {
  Vec3 v = Vec3::Zero();
  Vec3 w = Vec3::Zero();
};

/// Pose and velocity of a frame, both expressed in W.
struct RigidState {
  Pose X;
  Twist V;
};

/// Force `f` [N] and torque `t` [N·m]. The torque is taken about the origin of a frame, which the comment of each
/// variable of this type names.
struct Wrench {
  Vec3 f = Vec3::Zero();
  Vec3 t = Vec3::Zero();

  Wrench operator-() const { return {-f, -t}; }
  Wrench operator+(const Wrench& other) const { return {f + other.f, t + other.t}; }
  Wrench operator-(const Wrench& other) const { return {f - other.f, t - other.t}; }
  Wrench operator*(double scale) const { return {f * scale, t * scale}; }
  Wrench& operator+=(const Wrench& other) {
    f += other.f;
    t += other.t;
    return *this;
  }
};

inline bool is_finite(const Vec3& a) {
  return a.allFinite();
}
inline bool is_finite(const Quat& q) {
  return q.coeffs().allFinite();
}
inline bool is_finite(const Pose& X) {
  return is_finite(X.p) && is_finite(X.q);
}
inline bool is_finite(const Twist& V) {
  return is_finite(V.v) && is_finite(V.w);
}
inline bool is_finite(const RigidState& state) {
  return is_finite(state.X) && is_finite(state.V);
}
inline bool is_finite(const Wrench& F) {
  return is_finite(F.f) && is_finite(F.t);
}

/// Compares all components exactly; the result is false if any component is NaN.
inline bool is_same(const Pose& a, const Pose& b) {
  return a.p == b.p && a.q.coeffs() == b.q.coeffs();
}
inline bool is_same(const Twist& a, const Twist& b) {
  return a.v == b.v && a.w == b.w;
}
inline bool is_same(const RigidState& a, const RigidState& b) {
  return is_same(a.X, b.X) && is_same(a.V, b.V);
}

/// Returns the skew-symmetric matrix that maps b to a × b.
inline Eigen::Matrix3d cross_matrix(const Vec3& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Returns the rotation vector (axis · angle, |angle| ≤ π) of a unit quaternion. Since q and −q are the same rotation,
/// the angle is at most π.
inline Vec3 rotation_vector(const Quat& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Vec3 v = sign * q.vec();
  const double sine = v.norm();
  // For a small angle a, the sine of a/2 is a/2, so a/sine = 2. Below this limit that is exact in double precision.
  if (sine < 1e-9) return 2.0 * v;
  const double angle = 2.0 * std::atan2(sine, sign * q.w());
  return v * (angle / sine);
}

/// Returns the unit quaternion of a rotation vector; the inverse of rotation_vector().
inline Quat quaternion_of(const Vec3& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-12) return Quat(1.0, 0.5 * rotation.x(), 0.5 * rotation.y(), 0.5 * rotation.z()).normalized();
  return Quat(Eigen::AngleAxisd(angle, rotation / angle));
}

/// Returns the pose after a motion of `dt_s` seconds with a constant twist expressed in the world frame.
inline Pose integrate(const Pose& X_WB, const Twist& V_WB, double dt_s) {
  return {X_WB.p + V_WB.v * dt_s, (quaternion_of(V_WB.w * dt_s) * X_WB.q).normalized()};
}

/// Returns `a` if its length is at most `limit`, and otherwise a vector of length `limit` in the same direction.
/// Returns zero if `a` is not finite.
inline Vec3 clamped_to_length(const Vec3& a, double limit) {
  // The vector is first divided by its largest component, because the squares of huge components would overflow.
  const double largest = a.cwiseAbs().maxCoeff();
  if (!std::isfinite(largest) || !a.allFinite()) return Vec3::Zero();
  if (largest <= 0) return a;
  const Vec3 scaled = a / largest;
  const double length = scaled.norm() * largest;
  if (length <= limit) return a;
  return scaled / scaled.norm() * limit;
}

/// Returns the work [J] of a constant wrench while its frame moves from the pose `from` to the pose `to`. The torque is
/// about the frame's origin. All energy balances compute the work at a port with this function.
///
/// Model   f · (p_to − p_from) + τ · θ, where θ is the rotation vector of the shorter rotation from q_from to q_to
inline double held_work_j(const Wrench& wrench, const Pose& from, const Pose& to) {
  return wrench.f.dot(to.p - from.p) + wrench.t.dot(rotation_vector(to.q * from.q.conjugate()));
}

}  // namespace tandem
