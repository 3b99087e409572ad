// One of the two things of a contact benchmark, with what its preparation cost.
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
  std::shared_ptr<const contact::ContactShape> shape;  ///< as it comes out of the cache
  std::shared_ptr<const ExactSurface> exact;
  double build_s = 0;       ///< with its repair; 0: it was in the cache
  double cache_load_s = 0;  ///< from a file that the kernel still holds in memory, if it was built just before

  double cell_m() const;     ///< of the distance grid near the surface
  double spacing_m() const;  ///< of the surface's points
  std::size_t points() const;
};

/// Repairs the mesh, builds its asset, writes that to a temporary file and reads it back.
/// In      cache  a folder that keeps assets, or empty: what is there is not built
/// Fails   std::invalid_argument naming `name` and the reason when the mesh cannot be touched;
///         std::runtime_error when the temporary file cannot be used
TouchObject make_touch_object(const std::string& name, const geometry::TriangleMesh& mesh, const Clock& clock,
                              const std::filesystem::path& cache = {});

}  // namespace tandem::lab
