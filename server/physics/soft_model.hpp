// What a soft body is made of, before anything moves: nodes, links between them, the surface that is felt.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// More nodes would cost more than a soft step has time for.
inline constexpr std::size_t kMaxSoftNodes = 2000;
/// Of the surface, beside its nodes; a larger surface is sampled more widely.
inline constexpr std::size_t kMaxSoftSamples = 20'000;
/// No point of the surface at rest is farther than this over √2 from a sample, as long as the limit above holds.
inline constexpr double kSoftSampleSpacing_m = 3e-3;

/// A point of the surface that can touch: a mean of up to three nodes. Weights sum to 1.
struct SoftSample {
  std::array<int, 3> nodes{};
  std::array<double, 3> weights{};
};

/// Sides of the bounding box in the body's frame, as bits 0..5: −x, +x, −y, +y, −z, +z.
using SoftSides = std::uint8_t;

/// What both kinds of soft bodies have in common.
///
/// Stiffness and damping are coefficients of Bullet's position-based solver: how much of an error one sweep mends. What
/// they feel like depends on the rate and on the mass (server/README.md).
struct SoftTraits {
  double mass_kg = 0.2;
  SoftSides anchored = 0;  ///< nodes of these sides do not move
  Pose X_WS;
  double stiffness = 0.5;         ///< of the links, 0..1
  double damping = 0.1;           ///< of motion along the links, a step, 0..1
  double volume_stiffness = 0.5;  ///< of the enclosed volume, 0..1
  double friction = 0.5;
};

struct SoftModel {
  std::string name;
  std::vector<Vec3> nodes_W;    ///< at the start
  std::vector<double> mass_kg;  ///< of each node; 0: glued to the world
  std::vector<std::array<int, 2>> links;
  std::vector<std::array<int, 3>> faces;  ///< closed; corners counter-clockwise seen from outside
  std::vector<SoftSample> samples;        ///< nodes of the surface first
  SoftTraits traits;                      ///< that it was made with
};

/// Cells of a block along x, y, z: as few as keep their edges at most `spacing_m` long.
std::array<std::uint64_t, 3> soft_block_cells(const Vec3& size_m, double spacing_m);
/// Nodes of a block with these cells.
std::uint64_t soft_block_nodes(const std::array<std::uint64_t, 3>& cells);

/// A lattice of cells whose edges, face diagonals and space diagonals are links; centred.
SoftModel make_soft_block(const Vec3& size_m, double spacing_m, const SoftTraits& traits);

/// A closed surface: its edges are links, and so are the far corners of each two triangles that share an edge (against
/// bending). The inside is empty; the volume that it encloses is what resists.
/// In      mesh  every edge has two triangles, corners counter-clockwise seen from outside
SoftModel make_soft_surface(const geometry::TriangleMesh& mesh, const SoftTraits& traits);

/// Of a closed surface.
double enclosed_volume_m3(const std::vector<Vec3>& nodes, const std::vector<std::array<int, 3>>& faces);

}  // namespace tandem::server
