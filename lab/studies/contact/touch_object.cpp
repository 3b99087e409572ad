#include "lab/studies/contact/touch_object.hpp"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <vector>

#include "common/contact/field/distance_grid.hpp"
#include "server/assets/contact_cache.hpp"

namespace tandem::lab {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::shared_ptr<const contact::ContactShape> through_a_file(const std::vector<std::uint8_t>& bytes, const Clock& clock,
                                                            double& load_s) {
  const File file(std::tmpfile(), &std::fclose);
  const bool is_written = file != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                          std::fflush(file.get()) == 0;
  if (!is_written) throw std::runtime_error("a temporary file cannot be written; is the disk of /tmp full?");
  const LocalTime begin = clock.now();
  std::rewind(file.get());
  std::vector<std::uint8_t> read(bytes.size());
  if (std::fread(read.data(), 1, read.size(), file.get()) != read.size()) {
    throw std::runtime_error("a temporary file cannot be read back");
  }
  auto shape = contact::contact_shape_from(read);
  load_s = to_seconds(clock.now() - begin);
  if (shape == nullptr) throw std::runtime_error("a contact asset could not be read back from its own bytes");
  return shape;
}

/// Loads a shape from the cache. Returns null if the file is missing or incomplete.
std::shared_ptr<const contact::ContactShape> kept_shape(const std::filesystem::path& file, const proto::Sha256& key,
                                                        const Clock& clock, double& load_s) {
  const LocalTime begin = clock.now();
  auto shape = contact::contact_shape_from(server::read_kept_contact(file, key));
  load_s = to_seconds(clock.now() - begin);
  return shape;
}

}  // namespace

double TouchObject::cell_m() const {
  const auto* const grid = dynamic_cast<const contact::DistanceGrid*>(shape->field.get());
  return grid == nullptr ? 0 : grid->coarsest_cell_m();
}

double TouchObject::spacing_m() const {
  return shape->shells.surface.spacing_m;
}

std::size_t TouchObject::points() const {
  return shape->shells.surface.points.size() + shape->shells.features.points.size();
}

TouchObject make_touch_object(const std::string& name, const geometry::TriangleMesh& mesh, const Clock& clock,
                              const std::filesystem::path& cache) {
  TouchObject object;
  object.name = name;
  const LocalTime begin = clock.now();
  try {
    object.mesh = geometry::repaired(mesh);
  } catch (const geometry::MeshError& error) {
    throw std::invalid_argument(name + " cannot be touched: " + error.what());
  }
  const contact::ContactShapeOptions options;
  const proto::Sha256 key = cache.empty() ? proto::Sha256{} : server::contact_key(object.mesh, options);
  const std::filesystem::path kept = server::kept_contact_file(cache, key);
  if (!cache.empty()) object.shape = kept_shape(kept, key, clock, object.cache_load_s);
  if (object.shape == nullptr) {
    const auto built = contact::make_contact_mesh(object.mesh, options);
    object.build_s = to_seconds(clock.now() - begin);
    const std::vector<std::uint8_t> bytes = contact::contact_asset_bytes(*built);
    object.shape = through_a_file(bytes, clock, object.cache_load_s);
    const std::error_code error = cache.empty() ? std::error_code() : server::keep_contact(kept, key, bytes);
    if (error)
      std::cerr << kept.string() << " cannot be written (" << error.message() << "): the next run builds it again\n";
  }
  const bool is_sheet = object.mesh.kind == geometry::SurfaceKind::kSheet;
  const double half_m = options.sheet_thickness_m / 2;
  const auto beside =
      object.mesh.sheet.triangles.empty() ? nullptr : std::make_shared<const ExactSurface>(object.mesh.sheet, half_m);
  object.exact =
      std::make_shared<const ExactSurface>(object.mesh.mesh, is_sheet ? half_m : 0, beside, object.mesh.inner);
  return object;
}

}  // namespace tandem::lab
