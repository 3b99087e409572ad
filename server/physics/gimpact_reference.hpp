// Contact of a moving triangle mesh with a fixed mesh in unmodified Bullet. A reference for benchmarks of this
// project's contact solver; the server does not use it.
#pragma once

#include <cstddef>
#include <memory>

#include "common/base/time.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// One moving mesh and one fixed mesh as GImpact shapes in a Bullet world with its default solver.
class GImpactReference {
 public:
  /// Pose of the moving mesh after a step, and the cost of the step.
  struct Step {
    Pose X_WT;
    Twist V_WT;
    std::size_t contacts = 0;  ///< number of contact points in the manifold
    Duration query{0};         ///< time of collision detection alone
    Duration whole{0};
  };

  /// In      mass_kg, principal_inertia_kg_m2  of the moving mesh; the inertia about its origin and along its axes
  ///         clock  measures `Step::query` and `Step::whole`; must outlive this object
  GImpactReference(const geometry::TriangleMesh& moving, const geometry::TriangleMesh& fixed, double mass_kg,
                   const Vec3& principal_inertia_kg_m2, double friction, const Clock& clock);
  ~GImpactReference();

  void place(const Pose& X_WT);
  /// Advances by one step. The wrench acts on the moving mesh, about its origin.
  Step step(const Wrench& on_tool_W, double step_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
