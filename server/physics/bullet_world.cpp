#include "server/physics/bullet_world.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <algorithm>
#include <cmath>

#include "server/physics/bullet_convert.hpp"
#include "server/physics/collision_shape.hpp"

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

/// A body of the scene as Bullet has it; in Bullet's world while `rigid` is set.
struct Slot {
  std::unique_ptr<CollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
  physics::RigidBody* rigid = nullptr;
  Pose known;  ///< the centre's pose that Bullet has, as the rigid body was given it

  void take_pose();
  void take_velocity(double step_s);
  void give();
};

Slot make_slot(const physics::BodyDescription& description, const std::vector<SolidShape>& shapes) {
  Slot slot;
  const MassProperties& mass = description.mass;
  const bool is_static = mass.mass_kg <= 0;
  slot.shape = std::make_unique<CollisionShape>(shapes, mass.X_BC, is_static);
  const btRigidBody::btRigidBodyConstructionInfo info(mass.mass_kg, nullptr, &slot.shape->root(),
                                                      to_bullet(mass.principal_inertia_kg_m2));
  slot.body = std::make_unique<btRigidBody>(info);
  slot.body->setFriction(description.traits.friction);
  slot.body->setRestitution(description.traits.restitution);
  // A user may touch any body at any time, and a sleeping one would not answer at once.
  if (!is_static) slot.body->setActivationState(DISABLE_DEACTIVATION);
  if (!description.traits.has_gravity) slot.body->setFlags(slot.body->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  // Faster than its half thickness a step, a body is swept, so that it does not pass through thin walls.
  slot.body->setCcdMotionThreshold(slot.shape->half_thickness_m());
  slot.body->setCcdSweptSphereRadius(0.8 * slot.shape->half_thickness_m());
  return slot;
}

class BulletWorld final : public physics::FreeBodies {
 public:
  BulletWorld(const physics::WorldDescription& world, std::span<const std::vector<SolidShape>> shapes);

  void add(std::size_t index, physics::RigidBody& rigid) override;
  void remove(std::size_t index) override;
  void step(double step_s) noexcept override;

 private:
  // Bullet's world is destroyed before what it refers to.
  std::vector<Slot> slots_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
};

BulletWorld::BulletWorld(const physics::WorldDescription& world, std::span<const std::vector<SolidShape>> shapes)
    : dispatcher_(&configuration_), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  for (std::size_t i = 0; i < world.bodies.size(); ++i) slots_.push_back(make_slot(world.bodies[i], shapes[i]));
  install_contact_rules();
  world_.setGravity(to_bullet(world.gravity_m_per_s2));
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

void Slot::take_pose() {
  body->setLinearVelocity(to_bullet(rigid->velocity_of_centre_W().v));
  body->setAngularVelocity(to_bullet(rigid->velocity_of_centre_W().w));
  // After the velocities, which it copies for interpolation.
  body->setCenterOfMassTransform(to_bullet(rigid->centre_pose()));
  body->clearForces();
  known = rigid->centre_pose();
}

/// What was applied as velocity too, because Bullet's friction does not see the torque of forces: a body that is pushed
/// above or below its centre would creep.
void Slot::take_velocity(double step_s) {
  const Twist& V_WC = rigid->velocity_of_centre_W();
  const Wrench& applied = rigid->applied_W();
  body->setLinearVelocity(to_bullet(V_WC.v) + to_bullet(applied.f) * (body->getInvMass() * step_s));
  body->setAngularVelocity(to_bullet(V_WC.w) + body->getInvInertiaTensorWorld() * to_bullet(applied.t) * step_s);
}

void Slot::give() {
  known = from_bullet(body->getWorldTransform());
  rigid->set_centre(known, {from_bullet(body->getLinearVelocity()), from_bullet(body->getAngularVelocity())});
}

void BulletWorld::step(double step_s) noexcept {
  for (Slot& slot : slots_) {
    if (slot.rigid == nullptr || slot.rigid->is_static()) continue;
    // Bullet's own matrix is not rounded to a quaternion and back at each step.
    if (!is_same(slot.known, slot.rigid->centre_pose())) slot.take_pose();
    slot.take_velocity(step_s);
  }
  // No sub-steps: Bullet then advances by exactly this time.
  world_.stepSimulation(step_s, 0);
  for (Slot& slot : slots_) {
    if (slot.rigid != nullptr && !slot.rigid->is_static()) slot.give();
  }
}

}  // namespace

std::unique_ptr<physics::FreeBodies> make_bullet_world(const physics::WorldDescription& world,
                                                       std::span<const std::vector<SolidShape>> shapes) {
  return std::make_unique<BulletWorld>(world, shapes);
}

}  // namespace tandem::server
