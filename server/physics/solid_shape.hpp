// A shape of a body with its loaded data: enough for its mass and its contact shape.
#pragma once

#include <memory>

#include "common/geometry/mesh_repair.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

struct SolidShape {
  wire::Shape shape;                                                ///< complete
  std::shared_ptr<const geometry::TriangleMesh> mesh;               ///< repaired; for a solid its closed part
  geometry::SurfaceKind mesh_kind = geometry::SurfaceKind::kSolid;  ///< a sheet has no volume of its own
  std::shared_ptr<const geometry::ContactMesh> touched{};           ///< the mesh with all open parts
};

}  // namespace tandem::server
