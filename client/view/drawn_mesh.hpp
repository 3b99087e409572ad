// Converts the shapes of a scene to triangle meshes in the format of the graphics card. No window is needed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/shading.hpp"

namespace tandem::client {

using Rgba = std::array<float, 4>;  ///< red, green, blue (sRGB) and opacity, each 0 to 1

/// One vertex of a triangle, in the layout that the shaders of renderer.cpp read.
struct Vertex {
  std::array<float, 3> position_m{};
  std::array<float, 3> normal{};
  std::array<std::uint8_t, 4> color{};
};

/// Vertices of triangles: every three consecutive ones form a triangle, counter-clockwise when seen from outside.
using DrawnMesh = std::vector<Vertex>;

/// Appends a mesh with vertex normals. If the mesh has no normals (second function), they are computed with
/// geometry::shaded(), which drops some triangles.
void append_mesh(DrawnMesh& out, const geometry::ShadedMesh& shaded, const Pose& X, const Rgba& color);
void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color);

/// Converts a colour to the format of a vertex.
std::array<std::uint8_t, 4> bytes_of(const Rgba& color);

/// Appends a cone along the z axis, with its base of radius 1 at z = 0 and its tip at z = 1.
void append_cone(DrawnMesh& out);

/// Appends the lateral surface of a cylinder between two points.
void append_stick(DrawnMesh& out, const Vec3& from, const Vec3& to, double radius_m, int sides, const Rgba& color);

/// Returns a sphere of radius 1. It is made from an octahedron by `halvings` subdivisions, each of which halves all
/// edges.
geometry::TriangleMesh halved_octahedron(int halvings);
std::array<float, 3> floats_of(const Vec3& a);

}  // namespace tandem::client
