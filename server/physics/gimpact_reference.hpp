// What stock Bullet does with a moving triangle mesh against a fixed one: the peer that our own contact is held against
// in the lab's benchmarks. The server does not use it.
#pragma once

#include <cstddef>
#include <memory>

#include "common/base/time.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// One moving mesh and one fixed mesh as GImpact shapes in a Bullet world with its default solver.
class GImpactReference {
 public:
  struct Settings {
    double step_s = 0.001;
    double mass_kg = 0.1;
    Vec3 principal_inertia_kg_m2 = Vec3::Constant(1e-4);  ///< about the origin of the moving mesh, along its axes
    double friction = 0.5;
    double margin_m = 1e-4;  ///< by which Bullet grows the triangles of both meshes
  };
  /// Where the moving mesh is after a step and what the step took.
  struct Step {
    Pose X_WT;
    Twist V_WT;
    std::size_t contacts = 0;  ///< points of the manifold
    Duration query{0};         ///< collision detection alone
    Duration whole{0};
  };

  /// In      clock  what `Step::query` and `Step::whole` are measured with; must outlive this
  GImpactReference(const geometry::TriangleMesh& moving, const geometry::TriangleMesh& fixed, const Settings& settings,
                   const Clock& clock);
  ~GImpactReference();

  void place(const Pose& X_WT);
  /// Length of the steps from here on.
  void set_step(double step_s);
  /// Advances by one step with this wrench on the moving mesh, about its origin.
  Step step(const Wrench& on_tool_W);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server
