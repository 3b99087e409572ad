// Bullet's world with the settings that desk-sized scenes at 1 kHz need. Private to the world.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include "server/rigid_body.hpp"

namespace tandem {

/// Same bodies, same forces, same bits: bodies are kept in the order in which they were added, the solver's
/// order is not randomised, and a step is one solver step.
///
/// Contact of two bodies: friction √(μ₁ μ₂), restitution the larger of both.
class BulletWorld {
 public:
  explicit BulletWorld(const Vec3& gravity_m_per_s2);
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  /// `body` must stay alive until it is removed or this is destroyed.
  void add(RigidBody& body);
  void remove(RigidBody& body) { world_.removeRigidBody(&body.bullet()); }
  void step(double step_s);

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
};

}  // namespace tandem
