// Structure of a soft body at rest: nodes, the links between them, and the surface that can be touched.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Limit of nodes. More would cost more than the time of a soft step.
inline constexpr std::size_t kMaxSoftNodes = 2000;
/// Limit of surface samples, beside the nodes; a larger surface has a wider spacing.
inline constexpr std::size_t kMaxSoftSamples = 20'000;
/// Sample spacing. At rest no point of the surface is farther than this over √2 from a sample, within the limit above.
inline constexpr double kSoftSampleSpacing_m = 3e-3;

/// A point of the surface that can touch: a weighted mean of up to three nodes. Weights sum to 1.
struct SoftSample {
  std::array<int, 3> nodes{};
  std::array<double, 3> weights{};
};

/// Sides of the bounding box in the body's frame, as bits 0..5: −x, +x, −y, +y, −z, +z.
using SoftSides = std::uint8_t;

/// Properties common to both kinds of soft bodies.
///
/// Stiffness and damping are coefficients of Bullet's position-based solver: the share of an error that one sweep
/// corrects. The resulting stiffness depends on the rate and the mass (server/SOFT_BODIES.md).
struct SoftTraits {
  double mass_kg = 0.2;
  SoftSides anchored = 0;  ///< nodes of these sides do not move
  Pose X_WS;
  double stiffness = 0.5;         ///< gain of the links, 0..1
  double damping = 0.1;           ///< for motion along the links in each step, 0..1
  double volume_stiffness = 0.5;  ///< gain of the enclosed volume, 0..1
  double friction = 0.5;
};

struct SoftModel {
  std::string name;
  std::vector<Vec3> nodes_W;    ///< initial positions
  std::vector<double> mass_kg;  ///< parallel to nodes_W; 0: anchored to the world
  std::vector<std::array<int, 2>> links;
  std::vector<std::array<int, 3>> faces;  ///< closed; corners counter-clockwise seen from outside
  std::vector<SoftSample> samples;        ///< nodes of the surface first
  SoftTraits traits;                      ///< parameters of its construction
};

/// Cells of a block along x, y, z: the fewest whose edges are at most `spacing_m` long.
std::array<std::uint64_t, 3> soft_block_cells(const Vec3& size_m, double spacing_m);
/// Number of nodes of a block with these cells.
std::uint64_t soft_block_nodes(const std::array<std::uint64_t, 3>& cells);

/// Makes a centred lattice of cells whose edges, face diagonals and space diagonals are links.
SoftModel make_soft_block(const Vec3& size_m, double spacing_m, const SoftTraits& traits);

/// Makes a closed surface. Links are its edges and, against bending, the opposite corners of each pair of triangles
/// that share an edge. The inside is empty; the enclosed volume gives the resistance.
/// In      mesh  every edge has two triangles, corners counter-clockwise seen from outside
SoftModel make_soft_surface(const geometry::TriangleMesh& mesh, const SoftTraits& traits);

/// Volume enclosed by a closed surface.
double enclosed_volume_m3(const std::vector<Vec3>& nodes, const std::vector<std::array<int, 3>>& faces);

}  // namespace tandem::server
