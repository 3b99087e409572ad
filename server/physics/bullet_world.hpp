// Bullet's world with the settings that desk-sized scenes at 1 kHz need. Private to the world.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <memory>
#include <vector>

#include "common/physics/free_bodies.hpp"
#include "server/physics/collision_shape.hpp"

namespace tandem::server {

/// The bodies that no tool touches, stepped by Bullet.
///
/// Same bodies, same forces, same bits: bodies are kept in the order in which they were added, the solver's
/// order is not randomised, and a step is one solver step.
///
/// Contact of two bodies: friction √(μ₁ μ₂), restitution the larger of both.
class BulletWorld final : public physics::FreeBodies {
 public:
  explicit BulletWorld(std::shared_ptr<const LoadedScene> scene);
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  void add(std::size_t index, physics::RigidBody& rigid) override;
  void remove(std::size_t index) override;
  void step(double step_s) noexcept override;

 private:
  /// A body of the scene as Bullet has it; in Bullet's world while `rigid` is set.
  struct Slot {
    std::unique_ptr<CollisionShape> shape;
    std::unique_ptr<btRigidBody> body;
    physics::RigidBody* rigid = nullptr;
    Pose told;  ///< the centre's pose that Bullet has, as the rigid body was told

    void take_pose();
    void take_velocity(double step_s);
    void give();
  };
  static Slot make_slot(const wire::Body& description, const LoadedBody& loaded);

  // Bullet's world is destroyed before what it refers to.
  std::shared_ptr<const LoadedScene> scene_;  ///< has the meshes
  std::vector<Slot> slots_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
};

}  // namespace tandem::server
