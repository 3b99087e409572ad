#include "common/geometry/drawing_asset.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/base/byte_io.hpp"
#include "common/geometry/packing.hpp"
#include "common/geometry/surface_asset.hpp"

namespace tandem::geometry {
namespace {

constexpr std::uint32_t kDrawingMagic = 0x57524454;  // first four bytes of each asset: "TDRW"
constexpr int kPackingLevel = 9;
constexpr double kSteps = 65535;
constexpr double kNormalSteps = 127;
constexpr std::size_t kColumns = 3;

using Triangle = std::array<int, 3>;

std::array<std::int8_t, 2> steps_of(const Vec3& normal) {
  const Eigen::Vector2d at = in_square(normal) * kNormalSteps;
  return {static_cast<std::int8_t>(std::lround(at.x())), static_cast<std::int8_t>(std::lround(at.y()))};
}

Vec3 normal_of(std::int8_t x_steps, std::int8_t y_steps) {
  return direction_of(std::max(-1.0, x_steps / kNormalSteps), std::max(-1.0, y_steps / kNormalSteps));
}

void check(const ShadedMesh& shaded) {
  const auto& [mesh, normals] = shaded;
  const auto refuse_unless = [](bool is_good, const char* why) {
    if (!is_good) throw std::invalid_argument(std::string("a mesh cannot be made an asset for drawing: ") + why);
  };
  refuse_unless(!mesh.triangles.empty(), "it has no triangle");
  refuse_unless(mesh.triangles.size() <= kMaxDrawingTriangles && mesh.vertices.size() <= kMaxDrawingVertices,
                "it is too large");
  refuse_unless(normals.size() == mesh.vertices.size(), "a vertex has no normal");
  const auto is_near = [](const Vec3& p) { return is_finite(p) && p.cwiseAbs().maxCoeff() <= kMaxSurfaceReach_m; };
  refuse_unless(std::ranges::all_of(mesh.vertices, is_near), "a vertex is not finite, or too far");
  const auto is_unit = [](const Vec3& n) { return is_finite(n) && std::abs(n.norm() - 1) < 1e-3; };
  refuse_unless(std::ranges::all_of(normals, is_unit), "a normal is not of length 1");
  const auto is_whole = [&mesh = mesh](const Triangle& triangle) {
    return std::ranges::all_of(
        triangle, [&](int index) { return index >= 0 && static_cast<std::size_t>(index) < mesh.vertices.size(); });
  };
  refuse_unless(std::ranges::all_of(mesh.triangles, is_whole), "a triangle names a vertex that is not there");
}

/// Returns the same mesh with its vertices in the order of their first use; unused vertices are removed.
ShadedMesh in_order_of_use(const ShadedMesh& of) {
  std::vector<int> number_of(of.first.vertices.size(), -1);
  ShadedMesh out;
  for (Triangle triangle : of.first.triangles) {
    for (int& corner : triangle) {
      const auto index = static_cast<std::size_t>(corner);
      if (number_of[index] < 0) {
        number_of[index] = static_cast<int>(out.second.size());
        out.first.vertices.push_back(of.first.vertices[index]);
        out.second.push_back(of.second[index]);
      }
      corner = number_of[index];
    }
    out.first.triangles.push_back(triangle);
  }
  return out;
}

std::vector<std::uint8_t> coded_vertices(const std::vector<Vec3>& vertices, const Vec3& low, const Vec3& size) {
  std::vector<std::int32_t> steps;
  steps.reserve(kColumns * vertices.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::int32_t before = 0;
    for (const Vec3& vertex : vertices) {
      const double share = size[axis] > 0 ? (vertex[axis] - low[axis]) / size[axis] : 0;
      const auto now = static_cast<std::int32_t>(std::lround(std::clamp(share, 0.0, 1.0) * kSteps));
      steps.push_back(now - before);
      before = now;
    }
  }
  return planes_of(steps);
}

/// Decodes the vertices. Returns false if a vertex is outside the bounding box.
bool read_vertices(std::span<const std::uint8_t> block, const Vec3& low, const Vec3& size,
                   std::vector<Vec3>& vertices) {
  const std::vector<std::int32_t> steps = values_of(block);
  auto next = steps.begin();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::int64_t now = 0;
    for (Vec3& vertex : vertices) {
      now += *next++;
      if (now < 0 || now > static_cast<std::int64_t>(kSteps)) return false;
      vertex[axis] = low[axis] + static_cast<double>(now) / kSteps * size[axis];
    }
  }
  return true;
}

std::vector<std::uint8_t> coded_corners(const std::vector<Triangle>& triangles) {
  std::vector<std::int32_t> behind;
  behind.reserve(kColumns * triangles.size());
  int next = 0;  // lowest vertex index that no earlier triangle uses
  for (const Triangle& triangle : triangles) {
    for (const int corner : triangle) {
      behind.push_back(next - corner);
      next = std::max(next, corner + 1);
    }
  }
  return planes_of(behind);
}

/// Decodes the corners of triangles. Returns false if an index is out of range or if a vertex is in no triangle.
bool read_corners(std::span<const std::uint8_t> block, int vertices, std::vector<Triangle>& triangles) {
  const std::vector<std::int32_t> behind = values_of(block);
  auto next_number = behind.begin();
  int next = 0;
  for (Triangle& triangle : triangles) {
    for (int& corner : triangle) {
      const std::int64_t at = std::int64_t{next} - *next_number++;
      if (at < 0 || at >= vertices || at > next) return false;
      corner = static_cast<int>(at);
      next = std::max(next, corner + 1);
    }
  }
  return next == vertices;
}

Vec3 read_vector(ByteReader& reader) {
  const float x = reader.f32(), y = reader.f32(), z = reader.f32();
  return {x, y, z};
}

bool is_box(const Vec3& low, const Vec3& size) {
  return is_finite(low) && is_finite(size) && size.minCoeff() >= 0 &&
         low.cwiseAbs().maxCoeff() <= 2 * kMaxSurfaceReach_m && size.maxCoeff() <= 4 * kMaxSurfaceReach_m;
}

}  // namespace

std::vector<ShadedMesh> drawing_levels(const TriangleMesh& mesh) {
  std::vector<ShadedMesh> levels;
  const TriangleMesh finest = decimated(mesh, kMaxDrawingTriangles);
  for (const std::size_t most : kDrawingLevels) {
    if (finest.triangles.size() >= 2 * most) levels.push_back(shaded(decimated(finest, most)));
  }
  levels.push_back(shaded(finest));
  std::erase_if(levels, [](const ShadedMesh& level) { return level.first.triangles.empty(); });
  return levels;
}

std::vector<std::byte> drawing_asset_bytes(const ShadedMesh& shaded) {
  check(shaded);
  const auto [mesh, normals] = in_order_of_use(shaded);
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : mesh.vertices) box.extend(vertex);
  std::vector<std::uint8_t> octets = begin_asset(kDrawingMagic, kDrawingAssetVersion);
  ByteWriter writer(octets);
  const Vec3 low = box.min().cast<float>().cast<double>(), size = (box.max() - low).cast<float>().cast<double>();
  for (const Vec3& vector : {low, size}) {
    for (const double number : vector) writer.f32(static_cast<float>(number));
  }
  writer.u32(static_cast<std::uint32_t>(mesh.vertices.size()));
  writer.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
  std::vector<std::uint8_t> directions;
  for (const Vec3& normal : normals) {
    for (const std::int8_t step : steps_of(normal)) directions.push_back(static_cast<std::uint8_t>(step));
  }
  append_block(octets, coded_vertices(mesh.vertices, low, size), kPackingLevel);
  append_block(octets, directions, kPackingLevel);
  append_block(octets, coded_corners(mesh.triangles), kPackingLevel);
  end_asset(octets);
  return bytes_of(octets);
}

std::optional<ShadedMesh> drawing_from(std::span<const std::byte> bytes) {
  auto content = asset_content(octets_of(bytes), kDrawingMagic, kDrawingAssetVersion);
  if (!content) return std::nullopt;
  ByteReader reader(*content);
  const Vec3 low = read_vector(reader), size = read_vector(reader);
  const std::size_t vertices = reader.u32(), triangles = reader.u32();
  const bool fits = vertices <= kMaxDrawingVertices && triangles > 0 && triangles <= kMaxDrawingTriangles;
  if (!reader.ok() || !fits || !is_box(low, size)) return std::nullopt;
  const auto places = read_block(reader, 4 * kColumns * vertices);
  const auto directions = places ? read_block(reader, 2 * vertices) : std::nullopt;
  const auto corners = directions ? read_block(reader, 4 * kColumns * triangles) : std::nullopt;
  if (!corners || !content->empty() || places->size() != 4 * kColumns * vertices ||
      directions->size() != 2 * vertices || corners->size() != 4 * kColumns * triangles) {
    return std::nullopt;
  }
  ShadedMesh out;
  out.first.vertices.resize(vertices);
  out.first.triangles.resize(triangles);
  if (!read_vertices(*places, low, size, out.first.vertices)) return std::nullopt;
  if (!read_corners(*corners, static_cast<int>(vertices), out.first.triangles)) return std::nullopt;
  for (std::size_t i = 0; i < vertices; ++i) {
    out.second.push_back(
        normal_of(static_cast<std::int8_t>((*directions)[2 * i]), static_cast<std::int8_t>((*directions)[2 * i + 1])));
  }
  return out;
}

}  // namespace tandem::geometry
