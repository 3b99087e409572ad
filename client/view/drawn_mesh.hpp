// Triangles as the graphics card takes them, made of what a scene is described by. No window is needed for it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::client {

/// How molecules are drawn.
enum class MoleculeStyle : std::uint8_t { kBalls, kSticks, kSurface };
inline constexpr std::array<const char*, 3> kMoleculeStyleNames{"balls", "sticks", "surface"};  ///< by their number

using Rgba = std::array<float, 4>;  ///< as a screen has it (sRGB), 0 to 1; the last is how opaque

/// One corner of a triangle, as the shaders of renderer.cpp read it.
struct Vertex {
  std::array<float, 3> position_m{};
  std::array<float, 3> normal{};
  std::array<std::uint8_t, 4> color{};
};

/// Three corners each, counter-clockwise seen from outside.
using DrawnMesh = std::vector<Vertex>;

/// Adds a mesh: smooth where neighbouring faces meet at less than 40°, with an edge where they meet at more. Corners that
/// are not in the mesh are left out, with their triangle.
void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color);

/// Adds a ball for each atom, of its van der Waals radius: carbons in the molecule's own colour, the others as is usual
/// (nitrogen blue, oxygen red, sulphur yellow, hydrogen white). The client knows elements by their masses only.
void append_molecule(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom, const Rgba& carbon);

/// Likewise with a small ball for each atom and a stick, of both atoms' colours, for each bond: two atoms nearer than their
/// covalent radii and 0.4 Å.
/// Source  radii: Cordero et al., Dalton Trans. 2832 (2008)
void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom, const Rgba& carbon);

/// Of the element of that mass.
double van_der_waals_radius_angstrom(double mass_u);
Rgba atom_color(double mass_u, const Rgba& carbon);

/// As a vertex has it.
std::array<std::uint8_t, 4> bytes_of(const Rgba& color);

/// Adds a cone along z: its base of radius 1 at 0, its tip at 1.
void append_cone(DrawnMesh& out);

}  // namespace tandem::client
