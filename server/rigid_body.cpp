#include "server/rigid_body.hpp"

#include <algorithm>
#include <cmath>

#include "server/bullet_convert.hpp"

namespace tandem {

RigidBody::RigidBody(std::unique_ptr<CollisionShape> shape, const MassProperties& mass, const BodyTraits& traits,
                     const Pose& X_WB)
    : shape_(std::move(shape)), mass_(mass), traits_(traits), X_CB_(mass.X_BC.inverse()) {
  const btRigidBody::btRigidBodyConstructionInfo info(mass.mass_kg, nullptr, &shape_->root(),
                                                      to_bullet(mass.principal_inertia_kg_m2));
  body_ = std::make_unique<btRigidBody>(info);
  body_->setFriction(traits.friction);
  body_->setRestitution(traits.restitution);
  // A user may touch any body at any time, and a sleeping one would not answer at once.
  if (!is_static()) body_->setActivationState(DISABLE_DEACTIVATION);
  if (!traits.has_gravity) body_->setFlags(body_->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  // Faster than its half thickness a step, a body is swept, so that it does not pass through thin walls.
  body_->setCcdMotionThreshold(shape_->half_thickness_m());
  body_->setCcdSweptSphereRadius(0.8 * shape_->half_thickness_m());
  set_state({X_WB, Twist{}});
}

RigidState RigidBody::state() const {
  RigidState state;
  state.X = from_bullet(body_->getWorldTransform()) * X_CB_;
  state.V = {velocity_at_W(state.X.p), from_bullet(body_->getAngularVelocity())};
  return state;
}

void RigidBody::set_state(const RigidState& state) {
  const Pose X_WC = state.X * mass_.X_BC;
  body_->setLinearVelocity(to_bullet(state.V.v + state.V.w.cross(X_WC.p - state.X.p)));
  body_->setAngularVelocity(to_bullet(state.V.w));
  // After the velocities, which it copies for interpolation.
  body_->setCenterOfMassTransform(to_bullet(X_WC));
  body_->clearForces();
}

Vec3 RigidBody::centre_W() const {
  return from_bullet(body_->getWorldTransform().getOrigin());
}

Twist RigidBody::velocity_of_centre_W() const {
  return {from_bullet(body_->getLinearVelocity()), from_bullet(body_->getAngularVelocity())};
}

Eigen::Matrix3d RigidBody::inertia_W() const {
  const Eigen::Matrix3d R_WC = from_bullet(body_->getWorldTransform()).q.toRotationMatrix();
  return R_WC * mass_.principal_inertia_kg_m2.asDiagonal() * R_WC.transpose();
}

Wrench RigidBody::weight_W(const Vec3& gravity_m_per_s2) const {
  return {traits_.has_gravity ? Vec3(mass_.mass_kg * gravity_m_per_s2) : Vec3(Vec3::Zero()), Vec3::Zero()};
}

void RigidBody::advance(const Twist& V_WC, double step_s) {
  const Pose X_WC = integrate(from_bullet(body_->getWorldTransform()), V_WC, step_s);
  body_->setLinearVelocity(to_bullet(V_WC.v));
  body_->setAngularVelocity(to_bullet(V_WC.w));
  body_->setCenterOfMassTransform(to_bullet(X_WC));
  body_->clearForces();
}

Vec3 RigidBody::velocity_at_W(const Vec3& p_W) const {
  return from_bullet(body_->getLinearVelocity()) + from_bullet(body_->getAngularVelocity()).cross(p_W - centre_W());
}

void RigidBody::apply_wrench(const Wrench& wrench_W, const Vec3& p_W) {
  body_->applyCentralForce(to_bullet(wrench_W.f));
  body_->applyTorque(to_bullet(wrench_W.t + (p_W - centre_W()).cross(wrench_W.f)));
}

void RigidBody::damp(double step_s, double extra_per_s) {
  const double linear = std::exp(-(traits_.linear_damping_per_s + extra_per_s) * step_s);
  const double angular = std::exp(-(traits_.angular_damping_per_s + extra_per_s) * step_s);
  body_->setLinearVelocity(body_->getLinearVelocity() * linear);
  body_->setAngularVelocity(body_->getAngularVelocity() * angular);
}

bool RigidBody::limit_speed(double limit_m_per_s, double step_s) {
  const double speed = body_->getLinearVelocity().length();
  const double turn = body_->getAngularVelocity().length();
  // Half a radian a step is as far as Bullet's integration of rotation is sound.
  const double turn_limit = std::min(limit_m_per_s / shape_->radius_m(), 0.5 / step_s);
  if (speed > limit_m_per_s) body_->setLinearVelocity(body_->getLinearVelocity() * (limit_m_per_s / speed));
  if (turn > turn_limit) body_->setAngularVelocity(body_->getAngularVelocity() * (turn_limit / turn));
  return speed > limit_m_per_s || turn > turn_limit;
}

bool RigidBody::is_finite() const {
  const RigidState now = state();
  return tandem::is_finite(now.X) && tandem::is_finite(now.V);
}

double RigidBody::mechanical_energy_j(const Vec3& gravity_m_per_s2) const {
  const double speed_squared = body_->getLinearVelocity().length2();
  const Quat q_CW = from_bullet(body_->getWorldTransform()).q.conjugate();
  const Vec3 w_C = q_CW * from_bullet(body_->getAngularVelocity());
  const double spin = w_C.cwiseAbs2().dot(mass_.principal_inertia_kg_m2);
  const double height = traits_.has_gravity ? -mass_.mass_kg * gravity_m_per_s2.dot(centre_W()) : 0.0;
  return 0.5 * mass_.mass_kg * speed_squared + 0.5 * spin + height;
}

}  // namespace tandem
