// Writes and reads the asset bytes of a mesh's contact shape: a distance grid and two point shells.
#include <memory>
#include <span>
#include <stdexcept>
#include <utility>

#include "common/base/byte_io.hpp"
#include "common/base/progress.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/field/distance_grid.hpp"
#include "common/contact/points/flat_planes.hpp"
#include "common/contact/points/flat_points.hpp"
#include "common/realtime/large_pages.hpp"

namespace tandem::contact {
namespace {

constexpr std::uint32_t kKind = 0x41435454;  // first four bytes of each asset: "TTCA"

}  // namespace

std::vector<std::uint8_t> contact_asset_bytes(const ContactShape& shape, int packing_level) {
  const auto* grid = dynamic_cast<const DistanceGrid*>(shape.field.get());
  if (grid == nullptr) throw std::invalid_argument("only the shape of a mesh is an asset: a primitive is its formula");
  std::vector<std::uint8_t> bytes = begin_asset(kKind, kContactAssetVersion);
  ByteWriter writer(bytes);
  writer.f64(shape.rigid_depth_m);
  writer.f64(shape.half_thickness_m);
  grid->write(bytes, packing_level);
  shape.shells.surface.write(bytes, packing_level);
  shape.shells.features.write(bytes, packing_level);
  end_asset(bytes);
  return bytes;
}

std::vector<std::uint8_t> contact_asset_origin(const geometry::ContactMesh& mesh, const ContactShapeOptions& options) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(200 + mesh.mesh.vertices.size() * sizeof(Vec3) + mesh.mesh.triangles.size() * sizeof(int) * 3);
  ByteWriter writer(bytes);
  writer.u32(kContactAssetVersion);
  for (const double option : {options.cell_m, options.tolerance_m, options.band_m, options.spacing_m,
                              options.feature_angle_deg, options.feature_spacing_m, options.feature_height_m,
                              options.sheet_thickness_m, static_cast<double>(options.max_grid_bytes),
                              static_cast<double>(options.max_points), options.refines_rods ? 1.0 : 0.0}) {
    writer.f64(option);
  }
  writer.u32(static_cast<std::uint32_t>(mesh.kind));
  for (const geometry::TriangleMesh* part : {&mesh.mesh, &mesh.sheet, &mesh.inner}) {
    writer.u32(static_cast<std::uint32_t>(part->vertices.size()));
    for (const Vec3& vertex : part->vertices) writer.array(std::span<const double>(vertex.data(), 3));
    writer.u32(static_cast<std::uint32_t>(part->triangles.size()));
    for (const auto& triangle : part->triangles) writer.array(std::span<const int>(triangle));
  }
  return bytes;
}

std::shared_ptr<const ContactShape> contact_shape_from(std::span<const std::uint8_t> bytes, std::size_t limit_bytes) {
  auto content = asset_content(bytes, kKind, kContactAssetVersion);
  if (!content) return nullptr;
  auto& rest = *content;
  ByteReader reader(rest);
  auto shape = std::make_shared<ContactShape>();
  shape->rigid_depth_m = reader.f64();
  if (!reader.ok() || !(shape->rigid_depth_m >= kMinRigidDepth && shape->rigid_depth_m <= kMaxRigidDepth)) {
    return nullptr;
  }
  shape->half_thickness_m = reader.f64();
  if (!reader.ok() || !(shape->half_thickness_m >= 0 && shape->half_thickness_m <= kMaxHalfThickness)) return nullptr;
  std::unique_ptr<DistanceGrid> grid = DistanceGrid::read(rest, limit_bytes);
  if (!grid) return nullptr;
  auto surface = PointShell::read(rest, limit_bytes);
  auto features = PointShell::read(rest, limit_bytes);
  if (!surface || !features || surface->points.empty() || !rest.empty()) return nullptr;
  call_off_point();
  grid->find_planes(planes_of(*surface));
  call_off_point();
  drop_polygons_off(*grid, *surface);
  call_off_point();
  drop_polygons_off(*grid, *features);
  shape->field = std::move(grid);
  shape->shells = {std::move(*surface), std::move(*features)};
  for (const PointShell* shell : {&shape->shells.surface, &shape->shells.features}) {
    call_off_point();
    realtime::use_large_pages(std::as_bytes(std::span(shell->points)));
    realtime::use_large_pages(std::as_bytes(std::span(shell->nodes)));
  }
  call_off_point();
  shape->complete();
  return shape->memory_bytes() <= limit_bytes ? shape : nullptr;
}

}  // namespace tandem::contact
