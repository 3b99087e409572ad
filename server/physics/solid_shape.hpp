// A shape of a body with its loaded data: sufficient to compute its mass and its contact shape.
#pragma once

#include <memory>

#include "common/geometry/mesh_repair.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

struct SolidShape {
  wire::Shape shape;                                   ///< shape with all defaults filled in
  std::shared_ptr<const geometry::TriangleMesh> mesh;  ///< repaired mesh; for a solid, only its closed parts
  geometry::SurfaceKind mesh_kind = geometry::SurfaceKind::kSolid;  ///< a sheet encloses no volume
  std::shared_ptr<const geometry::ContactMesh> touched{};           ///< mesh for contact, including its open parts
};

}  // namespace tandem::server
