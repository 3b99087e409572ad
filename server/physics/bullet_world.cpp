#include "server/physics/bullet_world.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <cmath>

#include "server/physics/bullet_convert.hpp"

namespace tandem::server {
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

bool is_same(const Pose& a, const Pose& b) {
  return a.p == b.p && a.q.coeffs() == b.q.coeffs();
}

}  // namespace

BulletWorld::Slot BulletWorld::make_slot(const wire::Body& description, const LoadedBody& loaded) {
  Slot slot;
  const bool is_static = loaded.mass.mass_kg <= 0;
  slot.shape = std::make_unique<CollisionShape>(description.shapes(), loaded.shapes, loaded.mass.X_BC, is_static);
  const btRigidBody::btRigidBodyConstructionInfo info(loaded.mass.mass_kg, nullptr, &slot.shape->root(),
                                                      to_bullet(loaded.mass.principal_inertia_kg_m2));
  slot.body = std::make_unique<btRigidBody>(info);
  slot.body->setFriction(description.friction());
  slot.body->setRestitution(description.restitution());
  // A user may touch any body at any time, and a sleeping one would not answer at once.
  if (!is_static) slot.body->setActivationState(DISABLE_DEACTIVATION);
  if (!description.gravity()) slot.body->setFlags(slot.body->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  // Faster than its half thickness a step, a body is swept, so that it does not pass through thin walls.
  slot.body->setCcdMotionThreshold(slot.shape->half_thickness_m());
  slot.body->setCcdSweptSphereRadius(0.8 * slot.shape->half_thickness_m());
  return slot;
}

BulletWorld::BulletWorld(std::shared_ptr<const LoadedScene> scene)
    : scene_(std::move(scene)),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  for (std::size_t i = 0; i < scene_->bodies.size(); ++i) {
    slots_.push_back(make_slot(scene_->description.bodies(static_cast<int>(i)), scene_->bodies[i]));
  }
  install_contact_rules();
  const auto& gravity = scene_->description.gravity_m_per_s2();
  world_.setGravity({gravity[0], gravity[1], gravity[2]});
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

void BulletWorld::add(std::size_t index, physics::RigidBody& rigid) {
  Slot& slot = slots_[index];
  slot.rigid = &rigid;
  slot.take_pose();
  const bool collides = slot.shape->collides();
  const int group = rigid.is_static() ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter;
  const int all = btBroadphaseProxy::AllFilter;
  const int mask = rigid.is_static() ? all ^ btBroadphaseProxy::StaticFilter : all;
  world_.addRigidBody(slot.body.get(), collides ? group : 0, collides ? mask : 0);
}

void BulletWorld::remove(std::size_t index) {
  slots_[index].rigid = nullptr;
  world_.removeRigidBody(slots_[index].body.get());
}

void BulletWorld::Slot::take_pose() {
  body->setLinearVelocity(to_bullet(rigid->velocity_of_centre_W().v));
  body->setAngularVelocity(to_bullet(rigid->velocity_of_centre_W().w));
  // After the velocities, which it copies for interpolation.
  body->setCenterOfMassTransform(to_bullet(rigid->centre_pose()));
  body->clearForces();
  told = rigid->centre_pose();
}

/// What was applied as velocity too, because Bullet's friction does not see the torque of forces: a body that is pushed
/// above or below its centre would creep.
void BulletWorld::Slot::take_velocity(double step_s) {
  const Twist& V_WC = rigid->velocity_of_centre_W();
  const Wrench& applied = rigid->applied_W();
  body->setLinearVelocity(to_bullet(V_WC.v) + to_bullet(applied.f) * (body->getInvMass() * step_s));
  body->setAngularVelocity(to_bullet(V_WC.w) + body->getInvInertiaTensorWorld() * to_bullet(applied.t) * step_s);
}

void BulletWorld::Slot::give() {
  told = from_bullet(body->getWorldTransform());
  rigid->set_centre(told, {from_bullet(body->getLinearVelocity()), from_bullet(body->getAngularVelocity())});
}

void BulletWorld::step(double step_s) noexcept {
  for (Slot& slot : slots_) {
    if (slot.rigid == nullptr || slot.rigid->is_static()) continue;
    // Bullet's own matrix is not rounded to a quaternion and back at each step.
    if (!is_same(slot.told, slot.rigid->centre_pose())) slot.take_pose();
    slot.take_velocity(step_s);
  }
  // No sub-steps: Bullet then advances by exactly this time.
  world_.stepSimulation(step_s, 0);
  for (Slot& slot : slots_) {
    if (slot.rigid != nullptr && !slot.rigid->is_static()) slot.give();
  }
}

}  // namespace tandem::server
