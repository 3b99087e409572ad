// Soft body at rest: its nodes, the links between them, and its touchable surface.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Largest number of nodes of a soft body. A step with more nodes would take longer than the soft period, the time
/// between two soft steps.
inline constexpr std::size_t kMaxSoftNodes = 2000;
/// Largest number of surface samples in addition to the nodes. On a larger surface the spacing is increased.
inline constexpr std::size_t kMaxSoftSamples = 20'000;
/// Spacing of surface samples. For a body at rest, each point of the surface is within spacing / √2 of a sample, unless
/// kMaxSoftSamples enlarges the spacing.
inline constexpr double kSoftSampleSpacing_m = 3e-3;

/// A surface point that is tested for contact: a weighted mean of up to three nodes. The weights sum to 1.
struct SoftSample {
  std::array<int, 3> nodes{};
  std::array<double, 3> weights{};
};

/// Sides of the bounding box in the body's frame, as bits 0..5: −x, +x, −y, +y, −z, +z.
using SoftSides = std::uint8_t;

/// Properties of both kinds of soft bodies (block and surface).
///
/// Stiffness and damping are coefficients of Bullet's position-based solver. Each is the fraction of an error that one
/// sweep or step corrects. The resulting stiffness in N/m depends on the step rate and the mass
/// (server/SOFT_BODIES.md).
struct SoftTraits {
  double mass_kg = 0.2;
  SoftSides anchored = 0;  ///< sides whose nodes do not move
  Pose X_WS;
  double stiffness = 0.5;         ///< fraction of a link's error that a sweep corrects, 0..1
  double damping = 0.1;           ///< fraction of the motion along the links removed in each step, 0..1
  double volume_stiffness = 0.5;  ///< fraction of the error of the enclosed volume that a sweep corrects, 0..1
  double friction = 0.5;
};

struct SoftModel {
  std::string name;
  std::vector<Vec3> nodes_W;    ///< initial positions
  std::vector<double> mass_kg;  ///< parallel to nodes_W; 0: anchored to the world
  std::vector<std::array<int, 2>> links;
  std::vector<std::array<int, 3>> faces;  ///< closed; corners counter-clockwise seen from outside
  std::vector<SoftSample> samples;        ///< the nodes of the surface come first
  SoftTraits traits;                      ///< the parameters from which the model was made
};

/// Returns the numbers of cells of a block along x, y, z: the smallest for which no cell edge exceeds `spacing_m`.
std::array<std::uint64_t, 3> soft_block_cells(const Vec3& size_m, double spacing_m);
/// Number of nodes of a block with these cells.
std::uint64_t soft_block_nodes(const std::array<std::uint64_t, 3>& cells);

/// Makes a lattice of cells, centred at the origin. The edges, face diagonals and space diagonals of the cells are
/// links.
SoftModel make_soft_block(const Vec3& size_m, double spacing_m, const SoftTraits& traits);

/// Makes a hollow closed surface whose enclosed volume resists compression. Each edge of the mesh is a link. For
/// resistance to bending, the two corners opposite to each edge are linked as well.
/// In      mesh  each edge belongs to two triangles; corners counter-clockwise seen from outside
SoftModel make_soft_surface(const geometry::TriangleMesh& mesh, const SoftTraits& traits);

/// Volume enclosed by a closed surface.
double enclosed_volume_m3(const std::vector<Vec3>& nodes, const std::vector<std::array<int, 3>>& faces);

}  // namespace tandem::server
