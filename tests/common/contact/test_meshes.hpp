// Meshes with known distance functions, and the Stanford bunny as a typical scanned mesh.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::contact {

/// Splits every triangle into four and repeats this `times` times. The shape does not change.
inline geometry::TriangleMesh subdivided(geometry::TriangleMesh mesh, int times = 1) {
  for (; times > 0; --times) {
    std::map<std::pair<int, int>, int> middles;
    geometry::TriangleMesh finer;
    finer.vertices = mesh.vertices;
    const auto middle = [&](int a, int b) {
      const auto [found, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(finer.vertices.size()));
      if (is_new) {
        finer.vertices.emplace_back(
            0.5 * (mesh.vertices[static_cast<std::size_t>(a)] + mesh.vertices[static_cast<std::size_t>(b)]));
      }
      return found->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b);
      const int bc = middle(b, c);
      const int ca = middle(c, a);
      finer.triangles.insert(finer.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh = std::move(finer);
  }
  return mesh;
}

inline geometry::TriangleMesh box_mesh(const Vec3& size_m, const Vec3& centre_S = Vec3::Zero()) {
  geometry::TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    mesh.vertices.emplace_back(centre_S + sign.cwiseProduct(size_m));
  }
  for (const auto& [a, b, c, d] : {std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}, std::array{0, 1, 5, 4},
                                   std::array{2, 6, 7, 3}, std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

/// A square block that extends from z = 0 upwards and is centred at `middle`. It has a square through hole, centred at
/// x = y = 0.
inline geometry::TriangleMesh block_with_hole_mesh(double hole_m, double outer_m, double height_m,
                                                   const Vec3& middle = Vec3::Zero()) {
  geometry::TriangleMesh mesh;
  for (const auto& [half_m, about] : {std::pair(hole_m / 2, Vec3(0, 0, 0)), std::pair(outer_m / 2, middle)}) {
    for (const double z : {0.0, height_m}) {
      for (const auto& [x, y] : {std::pair(1, 1), std::pair(-1, 1), std::pair(-1, -1), std::pair(1, -1)}) {
        mesh.vertices.push_back(about + Vec3(half_m * x, half_m * y, z));
      }
    }
  }
  // The vertices form four rings of four corners: inner low from index 0, inner high from 4, outer low from 8, outer
  // high from 12. Each face joins two rings.
  for (int i = 0; i < 4; ++i) {
    const int next = (i + 1) % 4;
    for (const auto& [from, to] : {std::pair(8, 12), std::pair(12, 4), std::pair(4, 0), std::pair(0, 8)}) {
      mesh.triangles.push_back({from + i, from + next, to + next});
      mesh.triangles.push_back({from + i, to + next, to + i});
    }
  }
  return mesh;
}

/// An octahedron whose faces are subdivided `times` times, with all vertices moved to the sphere. It has 8 · 4^`times`
/// triangles.
inline geometry::TriangleMesh sphere_mesh(double radius_m, int times) {
  geometry::TriangleMesh mesh;
  for (int i = 0; i < 6; ++i) mesh.vertices.emplace_back(Vec3::Unit(i / 2) * (i % 2 == 0 ? radius_m : -radius_m));
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (; times > 0; --times) {
    mesh = subdivided(std::move(mesh));
    for (Vec3& vertex : mesh.vertices) vertex *= radius_m / vertex.norm();
  }
  return mesh;
}

/// Mesh of the Stanford bunny, installed by the Debian package glmark2-data.
inline const std::filesystem::path kBunnyFile = "/usr/share/glmark2/models/bunny.obj";

/// The Stanford bunny with merged vertices; its longest side is `size_m`.
inline geometry::TriangleMesh bunny_mesh(double size_m) {
  std::ifstream file(kBunnyFile);
  geometry::TriangleMesh mesh;
  std::map<std::array<double, 3>, int> index_of;
  std::vector<int> welded;
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      std::array<double, 3> p{};
      words >> p[0] >> p[1] >> p[2];
      const auto [found, is_new] = index_of.try_emplace(p, static_cast<int>(mesh.vertices.size()));
      if (is_new) mesh.vertices.emplace_back(p[0], p[1], p[2]);
      welded.push_back(found->second);
    } else if (kind == "f") {
      std::array<int, 3> triangle{};
      for (int& corner : triangle) {
        words >> corner;
        words.ignore(100, ' ');
        corner = welded.at(static_cast<std::size_t>(corner - 1));
      }
      if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0]) {
        mesh.triangles.push_back(triangle);
      }
    }
  }
  Vec3 low = mesh.vertices.front();
  Vec3 high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  const double scale = size_m / (high - low).maxCoeff();
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - 0.5 * (low + high)) * scale;
  return mesh;
}

/// A regular prism that extends from z = 0 upwards.
inline geometry::TriangleMesh prism_mesh(int sides, double radius_m, double height_m) {
  geometry::TriangleMesh mesh;
  for (const double z : {0.0, height_m}) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), z);
    }
    mesh.vertices.emplace_back(0, 0, z);
  }
  for (int i = 0; i < sides; ++i) {
    const int next = (i + 1) % sides, up = sides + 1;
    mesh.triangles.push_back({i, next, next + up});
    mesh.triangles.push_back({i, next + up, i + up});
    mesh.triangles.push_back({sides, next, i});
    mesh.triangles.push_back({sides + up, i + up, next + up});
  }
  return mesh;
}

}  // namespace tandem::contact
