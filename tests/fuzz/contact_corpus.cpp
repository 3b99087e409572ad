// Writes the seeds of contact_asset_fuzz: assets of a small solid and a small sheet in the current format. The seeds
// are generated, not committed: after a change of the format, every committed seed would be refused for its version
// number, and the test would pass without testing anything.
#include <filesystem>
#include <iostream>
#include <string>

#include "common/contact/contact_shape.hpp"
#include "common/geometry/tessellation.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using namespace tandem;

/// Returns options for small assets, because the runner changes every byte of a seed. Cells are coarse and points few.
/// The assets are not compressed, so that a changed byte reaches the readers instead of failing in the decompression.
contact::ContactShapeOptions coarse_options() {
  contact::ContactShapeOptions options;
  options.cell_m = 2e-3;
  options.tolerance_m = 1e-3;
  options.band_m = 2e-3;
  options.spacing_m = 3e-3;
  options.feature_spacing_m = 3e-3;
  return options;
}

void write(const std::filesystem::path& file, const geometry::ContactMesh& mesh) {
  const std::vector<std::uint8_t> bytes =
      contact::contact_asset_bytes(*contact::make_contact_mesh(mesh, coarse_options()), 0);
  fuzz::write_seed(file, std::as_bytes(std::span(bytes)));
  std::cout << file.string() << ": " << bytes.size() << " bytes\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  const geometry::TriangleMesh triangle{{Vec3(0, 0, 0), Vec3(3e-3, 0, 0), Vec3(0, 3e-3, 0)}, {{0, 1, 2}}};
  write(folder / "solid", {geometry::tessellated_box(Vec3(3e-3, 3e-3, 2e-3)), geometry::SurfaceKind::kSolid, {}});
  write(folder / "sheet", {triangle, geometry::SurfaceKind::kSheet, {}});
  return 0;
}
