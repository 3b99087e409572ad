// One of the two objects of a contact benchmark, with the cost of its preparation.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/base/time.hpp"
#include "common/contact/contact_shape.hpp"
#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

struct TouchObject {
  std::string name;
  geometry::ContactMesh mesh;
  std::shared_ptr<const contact::ContactShape> shape;  ///< loaded from the cache file
  std::shared_ptr<const ExactSurface> exact;
  double build_s = 0;       ///< build time with repair; 0: loaded from the cache
  double cache_load_s = 0;  ///< load time from a file, which the kernel still holds in memory if it was just built

  double cell_m() const;     ///< largest cell of the distance grid near the surface
  double spacing_m() const;  ///< spacing of the surface's points
  std::size_t points() const;
};

/// Repairs the mesh, builds its asset, writes the asset to a temporary file and reads it back.
/// In      cache  folder that keeps assets, or empty: an asset found there is not built
/// Fails   std::invalid_argument naming `name` and the reason when the mesh is unusable for contact;
///         std::runtime_error when the temporary file cannot be used
TouchObject make_touch_object(const std::string& name, const geometry::TriangleMesh& mesh, const Clock& clock,
                              const std::filesystem::path& cache = {});

}  // namespace tandem::lab
