// A shape of a body with what was loaded for it: enough for its mass and for its contact shape.
#pragma once

#include <memory>

#include "common/geometry/mesh_repair.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

struct SolidShape {
  wire::Shape shape;                                                ///< complete
  std::shared_ptr<const geometry::TriangleMesh> mesh;               ///< of a mesh shape, repaired; closed of a solid
  geometry::SurfaceKind mesh_kind = geometry::SurfaceKind::kSolid;  ///< a sheet has no volume of its own
  std::shared_ptr<const geometry::ContactMesh> touched{};           ///< the mesh with all that is open beside it
};

}  // namespace tandem::server
