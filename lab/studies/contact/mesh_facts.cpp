#include "lab/studies/contact/mesh_facts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/contact/contact_shape.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/repair/mesh_bounds.hpp"
#include "lab/studies/contact/wall_thickness.hpp"
#include "server/assets/mesh_file.hpp"

namespace tandem::lab {
namespace {

/// Size of a mesh up to which the contact grid has its finest cells. Above it the cells become wider in proportion to
/// the size (server/assets/scene_assets.cpp).
constexpr double kFullResolutionSize_m = 0.2;

/// Scales and rotates the mesh, moves its centre to the origin, and records size and scale in `facts`. Fails:
/// MeshError.
void place(geometry::TriangleMesh& mesh, const MeshScale& scale, bool turns, MeshFacts& facts) {
  for (Vec3& vertex : mesh.vertices) {
    if (turns) vertex = Vec3(vertex.x(), -vertex.z(), vertex.y());
  }
  const Eigen::AlignedBox3d bounds = geometry::mesh_bounds(mesh);
  facts.size_units = bounds.sizes();
  facts.scale_m = scale.largest_size_m > 0 ? scale.largest_size_m / facts.size_units.maxCoeff() : scale.scale;
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - bounds.center()) * facts.scale_m;
}

/// Returns the reason why the size of a mesh is implausible. The text is empty if the size is plausible or the user
/// requested it.
std::string doubt_of(const std::filesystem::path& file, const MeshScale& scale, const MeshFacts& facts) {
  const double size_m = facts.size_units.maxCoeff() * facts.scale_m;
  const std::string doubt =
      scale.largest_size_m > 0 ? std::string() : server::doubt_of_size(size_m, facts.scale_m, file);
  if (doubt.empty()) return doubt;
  const bool is_large = server::is_too_large(size_m);
  return doubt + (is_large ? " Else give --scale (0.001 if the file is in millimetres) or --largest-size"
                           : " Else give --scale or --largest-size");
}

/// A square image with a depth buffer, so that nearer surfaces cover farther ones.
class Canvas {
 public:
  explicit Canvas(int pixels)
      : pixels_(pixels),
        rgb_(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels) * 3, 255),
        depth_(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels),
               -std::numeric_limits<double>::infinity()) {}

  /// Draws a triangle.
  ///
  /// In      corners  corners of the triangle: x points right, y up, z towards the viewer; each coordinate is 0 to 1
  void draw(const std::array<Vec3, 3>& corners, bool is_sheet) {
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (normal.squaredNorm() == 0 || normal.z() == 0) return;
    const double facing = std::abs(normal.normalized().dot(Vec3(0.3, 0.4, 0.87)));
    const auto pixel_of = [this](double at) { return static_cast<int>(std::floor(at * pixels_)); };
    Vec3 low = corners[0], high = low;
    for (const Vec3& corner : corners) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    for (int y = std::max(0, pixel_of(low.y())); y <= std::min(pixels_ - 1, pixel_of(high.y())); ++y) {
      for (int x = std::max(0, pixel_of(low.x())); x <= std::min(pixels_ - 1, pixel_of(high.x())); ++x) {
        shade(corners, normal, {(x + 0.5) / pixels_, (y + 0.5) / pixels_, 0}, facing, is_sheet);
      }
    }
  }
  std::vector<std::uint8_t> release() { return std::move(rgb_); }

 private:
  void shade(const std::array<Vec3, 3>& corners, const Vec3& normal, const Vec3& at, double facing, bool is_sheet) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 side = corners[(i + 1) % 3] - corners[i];
      const Vec3 off = at - corners[i];
      if ((side.x() * off.y() - side.y() * off.x()) * normal.z() < 0) return;
    }
    const Vec3 off = at - corners[0];
    const double z = corners[0].z() - (normal.x() * off.x() + normal.y() * off.y()) / normal.z();
    const auto row = static_cast<std::size_t>(pixels_ - 1 - static_cast<int>(at.y() * pixels_));
    const std::size_t index = row * static_cast<std::size_t>(pixels_) + static_cast<std::size_t>(at.x() * pixels_);
    if (z <= depth_[index]) return;
    depth_[index] = z;
    const double light = (0.25 + 0.75 * facing) * (0.6 + 0.4 * std::clamp(z, 0.0, 1.0));
    const Vec3 colour = light * (is_sheet ? Vec3(90, 130, 230) : Vec3(225, 215, 200));
    for (std::size_t channel = 0; channel < 3; ++channel) {
      rgb_[3 * index + channel] = static_cast<std::uint8_t>(colour[static_cast<Eigen::Index>(channel)]);
    }
  }

  int pixels_;
  std::vector<std::uint8_t> rgb_;
  std::vector<double> depth_;
};

}  // namespace

MeshFacts mesh_facts(const std::filesystem::path& file, const MeshScale& scale,
                     const std::function<void(const std::string& warning)>& warn) {
  geometry::TriangleMesh read = server::read_mesh_file(file, "give a mesh file");
  MeshFacts facts;
  try {
    place(read, scale, scale.y_is_up && !server::states_up_axis(file), facts);
    facts.doubt = doubt_of(file, scale, facts);
    if (!facts.doubt.empty()) warn(facts.doubt);
    facts.mesh = geometry::repaired(read);
  } catch (const geometry::MeshError& error) {
    throw std::runtime_error(file.string() + ", which cannot be touched: " + error.what());
  }
  facts.size_m = geometry::mesh_bounds(geometry::all_of(facts.mesh)).sizes();
  facts.is_watertight = facts.mesh.kind == geometry::SurfaceKind::kSolid && facts.mesh.sheet.triangles.empty();
  for (const geometry::PartReport& part : facts.mesh.parts) {
    facts.volume_m3 += part.volume_m3;
    facts.is_watertight = facts.is_watertight && part.holes == 0;
  }
  const bool has_solid = facts.mesh.kind == geometry::SurfaceKind::kSolid;
  if (has_solid) {
    const auto [walls, overlap_share] = walls_of(facts.mesh.mesh);
    facts.thinnest_wall_m = thinnest_wall_m(walls);
    facts.overlap_share = overlap_share;
  }
  facts.resolution_m =
      contact::ContactShapeOptions{}.cell_m / 4 * std::max(1.0, facts.size_m.maxCoeff() / kFullResolutionSize_m);
  return facts;
}

std::vector<std::uint8_t> picture_of(const geometry::ContactMesh& mesh, int pixels) {
  const Vec3 to_viewer = Vec3(0.8, -1.0, 0.7).normalized();
  const Vec3 right = Vec3::UnitZ().cross(to_viewer).normalized();
  const Vec3 up = to_viewer.cross(right);
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  const auto seen = [&](const Vec3& p) { return Vec3(p.dot(right), p.dot(up), p.dot(to_viewer)); };
  for (const geometry::TriangleMesh* part : {&mesh.mesh, &mesh.sheet}) {
    for (const Vec3& vertex : part->vertices) {
      low = low.cwiseMin(seen(vertex));
      high = high.cwiseMax(seen(vertex));
    }
  }
  const double scale = 0.92 / std::max((high - low).maxCoeff(), 1e-300);
  const Vec3 middle = (low + high) / 2;
  Canvas canvas(pixels);
  for (const geometry::TriangleMesh* part : {&mesh.mesh, &mesh.sheet}) {
    const bool is_sheet = part == &mesh.sheet || mesh.kind == geometry::SurfaceKind::kSheet;
    for (const auto& triangle : part->triangles) {
      std::array<Vec3, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3& vertex = part->vertices[static_cast<std::size_t>(triangle[i])];
        corners[i] = (seen(vertex) - middle) * scale + Vec3::Constant(0.5);
      }
      canvas.draw(corners, is_sheet);
    }
  }
  return canvas.release();
}

}  // namespace tandem::lab
