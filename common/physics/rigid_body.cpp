#include "common/physics/rigid_body.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::physics {
namespace {

/// Maximum rotation in a substep of free rotation. With this value, the attitude error is 1° after 10 s, for a body
/// that rotates at 78 rad/s and steps of 1 ms.
constexpr double kMidpointTurn_rad = 0.02;
/// Number of iterations of the midpoint rule. Each iteration multiplies the error by about half the rotation in a
/// substep [rad], which is 0.01.
constexpr int kMidpointIterations = 4;
/// Maximum number of substeps. It suffices, because limit_speed() limits the rotation in a step to 0.5 rad.
constexpr int kMaxSubsteps = 32;

/// Returns the angular velocity for an angular momentum L: ω = R I⁻¹ Rᵀ L.
Vec3 angular_velocity_W(const Quat& q_WC, const Vec3& inertia_kg_m2, const Vec3& momentum_W) {
  return q_WC * (q_WC.conjugate() * momentum_W).cwiseQuotient(inertia_kg_m2);
}

}  // namespace

RigidBody::RigidBody(const MassProperties& mass, const BodyTraits& traits, double radius_m, const Pose& X_WB)
    : mass_(mass), traits_(traits), radius_m_(radius_m), X_CB_(mass.X_BC.inverse()) {
  set_state({X_WB, Twist{}});
}

RigidState RigidBody::state() const {
  return {X_WB_, {velocity_at_W(X_WB_.p), V_WC_.w}};
}

void RigidBody::set_state(const RigidState& state) {
  const Pose X_WC = state.X * mass_.X_BC;
  set_centre(X_WC, {state.V.v + state.V.w.cross(X_WC.p - state.X.p), state.V.w});
}

void RigidBody::set_centre(const Pose& X_WC, const Twist& V_WC) {
  X_WC_ = X_WC;
  X_WB_ = X_WC_ * X_CB_;
  V_WC_ = V_WC;
  applied_W_ = {};
}

Eigen::Matrix3d RigidBody::inertia_W() const {
  const Eigen::Matrix3d R_WC = X_WC_.q.toRotationMatrix();
  return R_WC * mass_.principal_inertia_kg_m2.asDiagonal() * R_WC.transpose();
}

Twist RigidBody::acceleration_W(const Wrench& wrench_W) const {
  const Vec3 t_C = X_WC_.q.conjugate() * wrench_W.t;
  return {wrench_W.f / mass_.mass_kg, X_WC_.q * t_C.cwiseQuotient(mass_.principal_inertia_kg_m2)};
}

Wrench RigidBody::weight_W(const Vec3& gravity_m_per_s2) const {
  return {traits_.has_gravity ? Vec3(mass_.mass_kg * gravity_m_per_s2) : Vec3(Vec3::Zero()), Vec3::Zero()};
}

void RigidBody::move(const Twist& V_WC, double step_s) {
  set_centre(integrate(X_WC_, V_WC, step_s), V_WC);
}

void RigidBody::advance(const Twist& V_WC, double step_s) {
  const Vec3& inertia = mass_.principal_inertia_kg_m2;
  const double turn = V_WC.w.norm() * step_s;
  const bool is_isotropic = inertia.minCoeff() == inertia.maxCoeff();
  if (is_isotropic || !(turn > 0) || !std::isfinite(turn)) return move(V_WC, step_s);
  const int substeps = static_cast<int>(std::clamp(std::ceil(turn / kMidpointTurn_rad), 1.0, double{kMaxSubsteps}));
  const double substep_s = step_s / substeps;
  const Vec3 momentum_W = X_WC_.q * (X_WC_.q.conjugate() * V_WC.w).cwiseProduct(inertia);
  Quat q_WC = X_WC_.q;
  Vec3 w = V_WC.w;
  for (int i = 0; i < substeps; ++i) {
    for (int k = 0; k < kMidpointIterations; ++k) {
      w = angular_velocity_W(quaternion_of(0.5 * substep_s * w) * q_WC, inertia, momentum_W);
    }
    q_WC = (quaternion_of(substep_s * w) * q_WC).normalized();
  }
  set_centre({X_WC_.p + V_WC.v * step_s, q_WC}, {V_WC.v, angular_velocity_W(q_WC, inertia, momentum_W)});
}

void RigidBody::shift(const Pose& by_W, const Twist& dv) {
  X_WC_ = {X_WC_.p + by_W.p, (by_W.q * X_WC_.q).normalized()};
  X_WB_ = X_WC_ * X_CB_;
  V_WC_ = {V_WC_.v + dv.v, V_WC_.w + dv.w};
}

void RigidBody::apply_wrench(const Wrench& wrench_W, const Vec3& p_W) {
  applied_W_ += {wrench_W.f, wrench_W.t + (p_W - X_WC_.p).cross(wrench_W.f)};
}

void RigidBody::damp(double step_s, double extra_per_s) {
  const double linear_per_s = traits_.linear_damping_per_s + extra_per_s;
  const double angular_per_s = traits_.angular_damping_per_s + extra_per_s;
  if (linear_per_s != 0) V_WC_.v *= std::exp(-linear_per_s * step_s);
  if (angular_per_s != 0) V_WC_.w *= std::exp(-angular_per_s * step_s);
}

bool RigidBody::limit_speed(double limit_m_per_s, double step_s) {
  const double speed = V_WC_.v.norm();
  const double turn = V_WC_.w.norm();
  // The rotation in a step is limited to 0.5 rad. Up to this angle its integration is accurate.
  const double turn_limit = std::min(limit_m_per_s / radius_m_, 0.5 / step_s);
  if (speed > limit_m_per_s) V_WC_.v *= limit_m_per_s / speed;
  if (turn > turn_limit) V_WC_.w *= turn_limit / turn;
  return speed > limit_m_per_s || turn > turn_limit;
}

double RigidBody::mechanical_energy_j(const Vec3& gravity_m_per_s2) const {
  const Vec3 w_C = X_WC_.q.conjugate() * V_WC_.w;
  const double spin = w_C.cwiseAbs2().dot(mass_.principal_inertia_kg_m2);
  const double height = traits_.has_gravity ? -mass_.mass_kg * gravity_m_per_s2.dot(X_WC_.p) : 0.0;
  return 0.5 * mass_.mass_kg * V_WC_.v.squaredNorm() + 0.5 * spin + height;
}

}  // namespace tandem::physics
