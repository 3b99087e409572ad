// One of the two objects of a contact benchmark, and the cost of preparing it.
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
  std::shared_ptr<const contact::ContactShape> shape;  ///< contact shape, as read back from the cache file
  std::shared_ptr<const ExactSurface> exact;
  double build_s = 0;  ///< build time including mesh repair [s]; 0: the object was loaded from the cache
  /// time to load the contact asset from its file [s]; after a build it includes no disk access, because the file is
  /// still in the kernel's page cache
  double cache_load_s = 0;

  double cell_m() const;     ///< largest cell of the distance grid near the surface
  double spacing_m() const;  ///< spacing of the sample points on the surface
  std::size_t points() const;
};

/// Repairs the mesh, builds its contact asset, writes the asset to a temporary file and reads it back.
/// In      cache  folder in which assets are stored; an asset found there is not built again; empty: no cache
/// Fails   std::invalid_argument: the mesh cannot be used for contact; the message contains `name` and the reason.
///         std::runtime_error: the temporary file cannot be used
TouchObject make_touch_object(const std::string& name, const geometry::TriangleMesh& mesh, const Clock& clock,
                              const std::filesystem::path& cache = {});

}  // namespace tandem::lab
