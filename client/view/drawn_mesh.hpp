// Triangle meshes in the graphics card's format, made from a scene's shapes. Needs no window.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/shading.hpp"

namespace tandem::client {

using Rgba = std::array<float, 4>;  ///< sRGB and opacity, 0 to 1

/// One corner of a triangle, in the layout that the shaders of renderer.cpp read.
struct Vertex {
  std::array<float, 3> position_m{};
  std::array<float, 3> normal{};
  std::array<std::uint8_t, 4> color{};
};

/// Triangles of three corners each, counter-clockwise seen from outside.
using DrawnMesh = std::vector<Vertex>;

/// Appends a shaded mesh, or shades and appends a mesh.
/// In      mesh  triangles that geometry::shaded() drops are not drawn
void append_mesh(DrawnMesh& out, const geometry::ShadedMesh& shaded, const Pose& X, const Rgba& color);
void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color);

/// Colour in a vertex's format.
std::array<std::uint8_t, 4> bytes_of(const Rgba& color);

/// Appends a cone along z: its base of radius 1 at 0, its tip at 1.
void append_cone(DrawnMesh& out);

/// Appends the side of a cylinder from one point to another.
void append_stick(DrawnMesh& out, const Vec3& from, const Vec3& to, double radius_m, int sides, const Rgba& color);

/// A ball of radius 1: an octahedron whose edges are halved `halvings` times.
geometry::TriangleMesh halved_octahedron(int halvings);
std::array<float, 3> floats_of(const Vec3& a);

}  // namespace tandem::client
