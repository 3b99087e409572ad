// What of a body collides: Bullet's shapes, owned together with what they point to. Private to the world.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>

#include <memory>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/physics/solid_shape.hpp"

namespace tandem::server {

/// How far outside their exact surface hulls and triangle meshes are felt, so that Bullet's distance algorithm
/// meets them before they overlap. Primitives do not grow: Bullet takes their margin off inside.
inline constexpr double kCollisionMargin_m = 1e-4;

/// The collision geometry of one body or tool, in its centre-of-mass frame C.
class CollisionShape {
 public:
  /// In      is_static  meshes are exact triangles, else their convex hulls
  CollisionShape(const std::vector<SolidShape>& shapes, const Pose& X_BC, bool is_static);

  btCollisionShape& root() { return *root_; }
  /// False for molecules, which feel the field only.
  bool collides() const { return collides_; }
  /// Of the sphere about C that holds everything.
  double radius_m() const { return radius_m_; }
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
  double radius_m_ = 0;
  double half_thickness_m_ = 0;
};

}  // namespace tandem::server
