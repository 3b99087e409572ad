// Triangles as the graphics card takes them, made of what a scene is described by. No window is needed for it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/shading.hpp"

namespace tandem::client {

using Rgba = std::array<float, 4>;  ///< as a screen has it (sRGB), 0 to 1; the last is how opaque

/// One corner of a triangle, as the shaders of renderer.cpp read it.
struct Vertex {
  std::array<float, 3> position_m{};
  std::array<float, 3> normal{};
  std::array<std::uint8_t, 4> color{};
};

/// Three corners each, counter-clockwise seen from outside.
using DrawnMesh = std::vector<Vertex>;

/// Adds a mesh that is shaded, or is to be.
/// In      mesh  what geometry::shaded() leaves out is not drawn
void append_mesh(DrawnMesh& out, const geometry::ShadedMesh& shaded, const Pose& X, const Rgba& color);
void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color);

/// As a vertex has it.
std::array<std::uint8_t, 4> bytes_of(const Rgba& color);

/// Adds a cone along z: its base of radius 1 at 0, its tip at 1.
void append_cone(DrawnMesh& out);

/// Adds the side of a cylinder from one point to another.
void append_stick(DrawnMesh& out, const Vec3& from, const Vec3& to, double radius_m, int sides, const Rgba& color);

/// A ball of radius 1: an octahedron, its edges halved so often.
geometry::TriangleMesh halved_octahedron(int halvings);
std::array<float, 3> floats_of(const Vec3& a);

}  // namespace tandem::client
