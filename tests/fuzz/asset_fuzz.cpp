// Reads arbitrary bytes as an asset from a server. The first byte selects a surface, a drawing or a molecule. Every
// accepted asset must be consistent, and a surface or molecule must not change when it is written and read again. The
// target first corrects the checksum at the end, because otherwise every input would be refused.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/docking/molecule_asset.hpp"
#include "common/geometry/drawing_asset.hpp"
#include "common/geometry/surface_asset.hpp"
#include "tests/fuzz/check.hpp"

using tandem::fuzz::check;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  if (size <= sizeof(std::uint64_t)) return 0;
  std::vector<std::uint8_t> raw(data + 1, data + size - sizeof(std::uint64_t));
  end_asset(raw);
  const std::span<const std::byte> bytes = std::as_bytes(std::span(raw));
  if (data[0] % 4 == 2) {
    const auto drawing = geometry::drawing_from(bytes);
    if (!drawing) return 0;
    const auto& [mesh, normals] = *drawing;
    check(normals.size() == mesh.vertices.size());
    for (const Vec3& normal : normals) check(std::abs(normal.norm() - 1) < 1e-9);
    std::vector<bool> is_used(mesh.vertices.size());
    for (const auto& triangle : mesh.triangles) {
      for (const int corner : triangle) {
        check(mesh.vertices.at(static_cast<std::size_t>(corner)).allFinite());
        is_used[static_cast<std::size_t>(corner)] = true;
      }
    }
    check(std::ranges::all_of(is_used, std::identity{}));
  } else if (data[0] % 2 == 0) {
    const auto surface = geometry::surface_from(bytes);
    if (!surface) return 0;
    for (const Vec3& vertex : surface->vertices) check(vertex.allFinite());
    const auto again = geometry::surface_from(geometry::surface_asset_bytes(*surface));
    check(again && again->vertices == surface->vertices && again->triangles == surface->triangles);
  } else {
    const auto molecule = docking::molecule_from(bytes);
    if (!molecule) return 0;
    const auto again = docking::molecule_asset_bytes(*molecule);
    check(std::ranges::equal(again, bytes));
  }
  return 0;
}
