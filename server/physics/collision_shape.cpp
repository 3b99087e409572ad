#include "server/physics/collision_shape.hpp"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btShapeHull.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <limits>

#include "proto/placement.hpp"
#include "server/physics/bullet_convert.hpp"
#include "server/physics/convex_hull.hpp"

namespace tandem::server {
namespace {

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

}  // namespace

CollisionShape::CollisionShape(const std::vector<SolidShape>& shapes, const Pose& X_BC, bool is_static) {
  for (const SolidShape& solid : shapes) parts_.push_back(make_part(solid, is_static));
  assemble(shapes, X_BC);
  btVector3 centre;
  btScalar radius = 0;
  root_->getBoundingSphere(centre, radius);
  radius_m_ = radius + centre.length();
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

}  // namespace tandem::server
