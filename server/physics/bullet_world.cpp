#include "server/physics/bullet_world.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btShapeHull.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "proto/placement.hpp"
#include "server/physics/bullet_convert.hpp"
#include "server/physics/convex_hull.hpp"

namespace tandem::server {
namespace {

btScalar combined_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::sqrt(a->getFriction() * b->getFriction());
}
btScalar combined_restitution(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getRestitution(), b->getRestitution());
}

/// How far boxes around bodies are beyond them: who is no farther from another may touch it, and rests or wakes with it. Bullet's own
/// 20 and 50 mm are for things of metres.
constexpr double kNear_m = 1e-3;
/// A body that has been slower for so long, with all that are near it, rests: it costs nothing until something acts on it, and
/// then answers in the same step.
constexpr double kRest_m_per_s = 2e-5, kRest_rad_per_s = 5e-4, kRest_s = 0.5;

/// Bullet's rules are global; they are set once, to the same for every world.
void install_contact_rules() {
  [[maybe_unused]] static const bool is_installed = [] {
    gCalculateCombinedFrictionCallback = combined_friction;
    gCalculateCombinedRestitutionCallback = combined_restitution;
    gContactBreakingThreshold = kNear_m;
    gDbvtMargin = kNear_m;
    gDeactivationTime = kRest_s;
    return true;
  }();
}

/// How far outside their exact surface hulls and triangle meshes are felt, so that Bullet's distance algorithm
/// meets them before they overlap. Primitives do not grow: Bullet takes their margin off inside.
constexpr double kCollisionMargin_m = 1e-4;

/// Hulls with more points are replaced by what supports them in 42 directions (btShapeHull): the cost of a
/// contact grows with the number of points, and the difference stays inside the exact hull.
constexpr int kMaxHullPoints = 100;

std::unique_ptr<btCollisionShape> make_hull(const geometry::TriangleMesh& mesh) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Vec3& point : convex_hull(mesh.vertices).vertices) hull->addPoint(to_bullet(point), false);
  if (hull->getNumPoints() > kMaxHullPoints) {
    btShapeHull reduced(hull.get());
    // Margin 0, so that the support points lie on the hull and not on its margin.
    hull->setMargin(0);
    reduced.buildHull(0);
    auto smaller = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < reduced.numVertices(); ++i) smaller->addPoint(reduced.getVertexPointer()[i], false);
    hull = std::move(smaller);
  }
  hull->setMargin(kCollisionMargin_m);
  hull->recalcLocalAabb();
  return hull;
}

std::unique_ptr<btCollisionShape> make_box(const wire::Box& box) {
  const btVector3 half(box.size_m(0) / 2, box.size_m(1) / 2, box.size_m(2) / 2);
  auto shape = std::make_unique<btBoxShape>(half);
  shape->setMargin(std::min<double>(kCollisionMargin_m, 0.1 * half[half.minAxis()]));
  return shape;
}

std::unique_ptr<btCollisionShape> make_cylinder(const wire::Cylinder& cylinder) {
  const double radius = cylinder.radius_m();
  const double half_length = cylinder.length_m() / 2;
  auto shape = std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, half_length));
  shape->setMargin(std::min({kCollisionMargin_m, 0.1 * radius, 0.1 * half_length}));
  return shape;
}

/// What of a body collides, in its centre-of-mass frame C: Bullet's shapes, owned together with what they point to.
class CollisionShape {
 public:
  /// In      is_static  meshes are exact triangles, else their convex hulls
  CollisionShape(const std::vector<SolidShape>& shapes, const Pose& X_BC, bool is_static);

  btCollisionShape& root() { return *root_; }
  /// False for molecules, which feel the field only.
  bool collides() const { return collides_; }
  /// Half the least thickness of any part: what may be moved in a step without passing through something.
  double half_thickness_m() const { return half_thickness_m_; }

 private:
  std::unique_ptr<btCollisionShape> make_part(const SolidShape& solid, bool is_static);
  std::unique_ptr<btCollisionShape> make_exact_mesh(const std::shared_ptr<const geometry::TriangleMesh>& mesh);
  void assemble(const std::vector<SolidShape>& shapes, const Pose& X_BC);

  std::vector<std::shared_ptr<const geometry::TriangleMesh>> meshes_;  ///< what `triangles_` point into
  std::vector<std::unique_ptr<btTriangleIndexVertexArray>> triangles_;
  std::vector<std::unique_ptr<btCollisionShape>> parts_;
  std::unique_ptr<btCollisionShape> compound_;
  btCollisionShape* root_ = nullptr;
  bool collides_ = true;
  double half_thickness_m_ = 0;
};

CollisionShape::CollisionShape(const std::vector<SolidShape>& shapes, const Pose& X_BC, bool is_static) {
  for (const SolidShape& solid : shapes) parts_.push_back(make_part(solid, is_static));
  assemble(shapes, X_BC);
  half_thickness_m_ = std::numeric_limits<double>::infinity();
  for (const auto& part : parts_) {
    btVector3 low, high;
    part->getAabb(btTransform::getIdentity(), low, high);
    const btVector3 size = high - low;
    half_thickness_m_ = std::min<double>(half_thickness_m_, size[size.minAxis()] / 2);
  }
}

std::unique_ptr<btCollisionShape> CollisionShape::make_part(const SolidShape& solid, bool is_static) {
  const wire::Shape& shape = solid.shape;
  switch (shape.kind_case()) {
    case wire::Shape::kBox:
      return make_box(shape.box());
    case wire::Shape::kCylinder:
      return make_cylinder(shape.cylinder());
    case wire::Shape::kCapsule:
      return std::make_unique<btCapsuleShapeZ>(shape.capsule().radius_m(), shape.capsule().length_m());
    case wire::Shape::kMesh:
      return is_static ? make_exact_mesh(solid.mesh) : make_hull(*solid.mesh);
    case wire::Shape::kMolecule:
      // Bullet wants a shape of every body; this one is in no collision group.
      collides_ = false;
      return std::make_unique<btSphereShape>(0.01);
    default:
      return std::make_unique<btSphereShape>(shape.sphere().radius_m());
  }
}

std::unique_ptr<btCollisionShape> CollisionShape::make_exact_mesh(
    const std::shared_ptr<const geometry::TriangleMesh>& shared_mesh) {
  meshes_.push_back(shared_mesh);
  const geometry::TriangleMesh& mesh = *shared_mesh;
  static_assert(sizeof(Vec3) == 3 * sizeof(btScalar));
  // Bullet's signature lacks const; the tree only reads.
  auto* const indices = const_cast<int*>(mesh.triangles.front().data());
  auto* const vertices = const_cast<double*>(mesh.vertices.front().data());
  triangles_.push_back(std::make_unique<btTriangleIndexVertexArray>(
      static_cast<int>(mesh.triangles.size()), indices, static_cast<int>(sizeof(mesh.triangles.front())),
      static_cast<int>(mesh.vertices.size()), vertices, static_cast<int>(sizeof(Vec3))));
  auto shape = std::make_unique<btBvhTriangleMeshShape>(triangles_.back().get(), true);
  shape->setMargin(kCollisionMargin_m);
  return shape;
}

void CollisionShape::assemble(const std::vector<SolidShape>& shapes, const Pose& X_BC) {
  const Pose X_CB = X_BC.inverse();
  const auto X_CS = [&](std::size_t i) { return X_CB * proto::pose_from_placement(shapes[i].shape.placement()); };
  const auto is_identity = [](const Pose& X) { return X.p.isZero(0) && X.q.vec().isZero(0); };
  if (parts_.size() == 1 && is_identity(X_CS(0))) {
    root_ = parts_.front().get();
    return;
  }
  auto compound = std::make_unique<btCompoundShape>();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    compound->addChildShape(to_bullet(X_CS(i)), parts_[i].get());
  }
  compound->setMargin(kCollisionMargin_m);
  root_ = compound.get();
  compound_ = std::move(compound);
}

/// A body of the scene as Bullet has it; in Bullet's world while `rigid` is set.
struct Slot {
  std::unique_ptr<CollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
  physics::RigidBody* rigid = nullptr;
  Pose known;           ///< the centre's pose that Bullet has, as the rigid body was given it
  Twist known_V;        ///< likewise its velocity
  bool sleeps = false;  ///< at rest, and left out of the step

  bool is_free() const { return rigid != nullptr && !rigid->is_static(); }
  bool is_disturbed() const;
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
  slot.body->setSleepingThresholds(kRest_m_per_s, kRest_rad_per_s);
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
  void wake_neighbours(const btRigidBody& body);
  void take(Slot& slot, double step_s);

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
  // Else the distance at which a contact ends is a share of each body's size, not kNear_m.
  dispatcher_.setDispatcherFlags(dispatcher_.getDispatcherFlags() &
                                 ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
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
  if (!rigid.is_static()) slot.body->forceActivationState(ACTIVE_TAG);
}

void BulletWorld::remove(std::size_t index) {
  wake_neighbours(*slots_[index].body);
  slots_[index].rigid = nullptr;
  world_.removeRigidBody(slots_[index].body.get());
}

/// Who may rest on it falls.
void BulletWorld::wake_neighbours(const btRigidBody& body) {
  const btBroadphasePairArray& pairs = broadphase_.getOverlappingPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    auto* const first = static_cast<btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject);
    auto* const second = static_cast<btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject);
    if (first == &body) second->activate();
    if (second == &body) first->activate();
  }
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
  known_V = {from_bullet(body->getLinearVelocity()), from_bullet(body->getAngularVelocity())};
  rigid->set_centre(known, known_V);
}

bool Slot::is_disturbed() const {
  const Wrench& applied = rigid->applied_W();
  return !applied.f.isZero(0) || !applied.t.isZero(0) || !is_same(known, rigid->centre_pose()) ||
         !is_same(known_V, rigid->velocity_of_centre_W());
}

void BulletWorld::take(Slot& slot, double step_s) {
  if (slot.sleeps && slot.is_disturbed()) slot.body->activate(true);
  slot.sleeps = !slot.body->isActive();
  if (slot.sleeps) return;
  // Bullet's own matrix is not rounded to a quaternion and back at each step.
  if (!is_same(slot.known, slot.rigid->centre_pose())) {
    wake_neighbours(*slot.body);
    slot.take_pose();
  }
  slot.take_velocity(step_s);
}

void BulletWorld::step(double step_s) noexcept {
  bool is_any_awake = false;
  for (Slot& slot : slots_) {
    if (!slot.is_free()) continue;
    take(slot, step_s);
    is_any_awake = is_any_awake || !slot.sleeps;
  }
  if (!is_any_awake) return;
  // No sub-steps: Bullet then advances by exactly this time.
  world_.stepSimulation(step_s, 0);
  for (Slot& slot : slots_) {
    // Whom another has woken in this step has moved, too; and who fell asleep in it is told that it rests.
    if (slot.is_free() && (!slot.sleeps || slot.body->isActive())) slot.give();
  }
}

}  // namespace

std::unique_ptr<physics::FreeBodies> make_bullet_world(const physics::WorldDescription& world,
                                                       std::span<const std::vector<SolidShape>> shapes) {
  return std::make_unique<BulletWorld>(world, shapes);
}

}  // namespace tandem::server
