#include "server/physics/gimpact_reference.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <cmath>

#include "server/physics/bullet_convert.hpp"

namespace tandem::server {
namespace {

/// Collision margin that Bullet adds to the triangles of both meshes.
constexpr double kMargin_m = 1e-4;

/// A mesh with a copy of its triangles, to which Bullet's shape refers.
class GImpactMesh {
 public:
  GImpactMesh(const geometry::TriangleMesh& mesh, double margin_m)
      : mesh_(mesh),
        triangles_(static_cast<int>(mesh_.triangles.size()), mesh_.triangles.front().data(),
                   static_cast<int>(sizeof(mesh_.triangles.front())), static_cast<int>(mesh_.vertices.size()),
                   mesh_.vertices.front().data(), static_cast<int>(sizeof(Vec3))),
        shape_(&triangles_) {
    static_assert(sizeof(Vec3) == 3 * sizeof(btScalar));
    shape_.setMargin(margin_m);
    shape_.updateBound();
  }
  btCollisionShape& shape() { return shape_; }

 private:
  geometry::TriangleMesh mesh_;
  btTriangleIndexVertexArray triangles_;
  btGImpactMeshShape shape_;
};

class TimedWorld final : public btDiscreteDynamicsWorld {
 public:
  TimedWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase, btConstraintSolver* solver,
             btCollisionConfiguration* configuration, const Clock& clock)
      : btDiscreteDynamicsWorld(dispatcher, broadphase, solver, configuration), clock_(clock) {}

  void performDiscreteCollisionDetection() override {
    const LocalTime begin = clock_.now();
    btDiscreteDynamicsWorld::performDiscreteCollisionDetection();
    query = clock_.now() - begin;
  }

  Duration query{0};

 private:
  const Clock& clock_;
};

}  // namespace

struct GImpactReference::Impl {
  Impl(const geometry::TriangleMesh& moving, const geometry::TriangleMesh& fixed, double mass_kg,
       const Vec3& principal_inertia_kg_m2, double friction, const Clock& clock_in)
      : clock(clock_in),
        moving_mesh(moving, kMargin_m),
        fixed_mesh(fixed, kMargin_m),
        dispatcher(&configuration),
        world(&dispatcher, &broadphase, &solver, &configuration, clock),
        tool(mass_kg, nullptr, &moving_mesh.shape(), to_bullet(principal_inertia_kg_m2)),
        wall(0, nullptr, &fixed_mesh.shape()) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
    world.setGravity(btVector3(0, 0, 0));
    for (btRigidBody* body : {&tool, &wall}) {
      body->setFriction(std::sqrt(friction));
      body->setActivationState(DISABLE_DEACTIVATION);
      world.addRigidBody(body);
    }
  }
  ~Impl() {
    world.removeRigidBody(&tool);
    world.removeRigidBody(&wall);
  }

  std::size_t contacts() const {
    std::size_t count = 0;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
      count += static_cast<std::size_t>(dispatcher.getManifoldByIndexInternal(i)->getNumContacts());
    }
    return count;
  }

  const Clock& clock;
  GImpactMesh moving_mesh;
  GImpactMesh fixed_mesh;
  btDefaultCollisionConfiguration configuration;
  mutable btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  TimedWorld world;
  btRigidBody tool;
  btRigidBody wall;
};

GImpactReference::GImpactReference(const geometry::TriangleMesh& moving, const geometry::TriangleMesh& fixed,
                                   double mass_kg, const Vec3& principal_inertia_kg_m2, double friction,
                                   const Clock& clock)
    : impl_(std::make_unique<Impl>(moving, fixed, mass_kg, principal_inertia_kg_m2, friction, clock)) {}
GImpactReference::~GImpactReference() = default;

void GImpactReference::place(const Pose& X_WT) {
  impl_->tool.setWorldTransform(to_bullet(X_WT));
  impl_->tool.setLinearVelocity(btVector3(0, 0, 0));
  impl_->tool.setAngularVelocity(btVector3(0, 0, 0));
}

GImpactReference::Step GImpactReference::step(const Wrench& on_tool_W, double step_s) {
  Impl& all = *impl_;
  const LocalTime begin = all.clock.now();
  all.tool.applyCentralForce(to_bullet(on_tool_W.f));
  all.tool.applyTorque(to_bullet(on_tool_W.t));
  // With 0 sub-steps, Bullet advances by exactly `step_s` instead of by fixed internal steps.
  all.world.stepSimulation(step_s, 0);
  Step result;
  result.whole = all.clock.now() - begin;
  result.query = all.world.query;
  result.X_WT = from_bullet(all.tool.getWorldTransform());
  result.V_WT = {from_bullet(all.tool.getLinearVelocity()), from_bullet(all.tool.getAngularVelocity())};
  result.contacts = all.contacts();
  return result;
}

}  // namespace tandem::server
