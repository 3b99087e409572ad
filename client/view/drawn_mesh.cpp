#include "client/view/drawn_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::client {
namespace {

constexpr int kConeSides = 20;
constexpr Rgba kWhite{1, 1, 1, 1};

/// Appends the lateral surface between two circles around the z axis, which may differ in radius and height. If a
/// circle has the radius 0, the surface is a cone with its tip there.
void append_band(geometry::TriangleMesh& mesh, double low_radius, double low_z, double high_radius, double high_z,
                 int sides) {
  const auto first = static_cast<int>(mesh.vertices.size());
  for (int side = 0; side < sides; ++side) {
    const double angle = 2 * std::numbers::pi * side / sides;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    mesh.vertices.push_back(low_radius * out + low_z * Vec3::UnitZ());
    mesh.vertices.push_back(high_radius * out + high_z * Vec3::UnitZ());
  }
  for (int side = 0; side < sides; ++side) {
    const int a = first + 2 * side, b = first + 2 * ((side + 1) % sides);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
}

}  // namespace

std::array<float, 3> floats_of(const Vec3& a) {
  return {static_cast<float>(a.x()), static_cast<float>(a.y()), static_cast<float>(a.z())};
}

geometry::TriangleMesh halved_octahedron(int halvings) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int i = 0; i < halvings; ++i) {
    geometry::TriangleMesh finer{.vertices = mesh.vertices, .triangles = {}};
    const auto middle = [&finer](int a, int b) {
      finer.vertices.push_back(
          (finer.vertices[static_cast<std::size_t>(a)] + finer.vertices[static_cast<std::size_t>(b)]).normalized());
      return static_cast<int>(finer.vertices.size()) - 1;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const std::array<int, 3>& part : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
        finer.triangles.push_back(part);
      }
    }
    mesh = std::move(finer);
  }
  return mesh;
}

std::array<std::uint8_t, 4> bytes_of(const Rgba& color) {
  std::array<std::uint8_t, 4> result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = static_cast<std::uint8_t>(std::lround(std::clamp(color[i], 0.0F, 1.0F) * 255));
  }
  return result;
}

void append_mesh(DrawnMesh& out, const geometry::ShadedMesh& shaded, const Pose& X, const Rgba& color) {
  const auto& [mesh, normals] = shaded;
  const std::array<std::uint8_t, 4> bytes = bytes_of(color);
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      const auto vertex = static_cast<std::size_t>(corner);
      out.push_back({floats_of(X * mesh.vertices[vertex]), floats_of(X.q * normals[vertex]), bytes});
    }
  }
}

void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color) {
  append_mesh(out, geometry::shaded(mesh), X, color);
}

void append_cone(DrawnMesh& out) {
  geometry::TriangleMesh mesh;
  append_band(mesh, 0, 0, 1, 0, kConeSides);
  append_band(mesh, 1, 0, 0, 1, kConeSides);
  append_mesh(out, mesh, Pose{}, kWhite);
}

void append_stick(DrawnMesh& out, const Vec3& from, const Vec3& to, double radius_m, int sides, const Rgba& color) {
  geometry::TriangleMesh mesh;
  append_band(mesh, radius_m, 0, radius_m, (to - from).norm(), sides);
  append_mesh(out, mesh, {from, Quat::FromTwoVectors(Vec3::UnitZ(), to - from)}, color);
}

}  // namespace tandem::client
