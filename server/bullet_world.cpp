#include "server/bullet_world.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <cmath>

#include "server/bullet_convert.hpp"

namespace tandem {
namespace {

btScalar combined_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::sqrt(a->getFriction() * b->getFriction());
}
btScalar combined_restitution(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getRestitution(), b->getRestitution());
}

/// Bullet's rules of combination are global; they are set once, to the same for every world.
void install_contact_rules() {
  [[maybe_unused]] static const bool is_installed = [] {
    gCalculateCombinedFrictionCallback = combined_friction;
    gCalculateCombinedRestitutionCallback = combined_restitution;
    return true;
  }();
}

}  // namespace

BulletWorld::BulletWorld(const Vec3& gravity_m_per_s2)
    : dispatcher_(&configuration_), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  install_contact_rules();
  world_.setGravity(to_bullet(gravity_m_per_s2));
  world_.setForceUpdateAllAabbs(false);
  btContactSolverInfo& solver = world_.getSolverInfo();
  // Overlap is undone by moving the bodies, never by giving them speed: a resting body rests, and pressing a
  // tool into a body does not store energy there.
  solver.m_splitImpulse = true;
  solver.m_splitImpulsePenetrationThreshold = 0;
  solver.m_erp2 = 0.2;
  solver.m_numIterations = 20;
  // Two directions, the first along the slip, so that friction has no preferred axis.
  solver.m_solverMode = SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS;
}

void BulletWorld::add(RigidBody& body) {
  const bool collides = body.shape().collides();
  const int group = body.is_static() ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter;
  const int all = btBroadphaseProxy::AllFilter;
  const int mask = body.is_static() ? all ^ btBroadphaseProxy::StaticFilter : all;
  world_.addRigidBody(&body.bullet(), collides ? group : 0, collides ? mask : 0);
}

void BulletWorld::step(double step_s) {
  // As velocity, because Bullet's friction does not see the torque of forces: a body that is pushed above or below its
  // centre would creep.
  const auto& bodies = world_.getNonStaticRigidBodies();
  for (int i = 0; i < bodies.size(); ++i) {
    btRigidBody& body = *bodies[i];
    body.setLinearVelocity(body.getLinearVelocity() + body.getTotalForce() * (body.getInvMass() * step_s));
    body.setAngularVelocity(body.getAngularVelocity() +
                            body.getInvInertiaTensorWorld() * body.getTotalTorque() * step_s);
    body.clearForces();
  }
  // No sub-steps: Bullet then advances by exactly this time.
  world_.stepSimulation(step_s, 0);
}

}  // namespace tandem
