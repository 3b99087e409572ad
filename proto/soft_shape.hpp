// Deformation of a soft body for display: the displacements of a lattice of points on the surface of its bounding box.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/spatial.hpp"
#include "tandem/control.pb.h"

namespace tandem::proto {

inline constexpr std::size_t kSoftLatticeEdge = 8;
inline constexpr std::size_t kSoftLatticePoints = 8 * 8 * 8 - 6 * 6 * 6;

/// Returns the lattice points relative to the centre of the box, as fractions −0.5..0.5 of the box's edges. The index
/// runs through x fastest, then y.
const std::array<Vec3, kSoftLatticePoints>& soft_lattice();
/// Returns the triangles of the lattice, counter-clockwise when seen from outside.
const std::vector<std::array<int, 3>>& soft_lattice_faces();

/// Indices and weights of the up to four positions nearest to a point. The weights are proportional to 1 / distance and
/// sum to 1. With fewer than four positions, the remaining entries have the weight 0.
using NearPlaces = std::array<std::pair<std::size_t, double>, 4>;
NearPlaces places_near(const Vec3& at, std::span<const Vec3> places);
/// Returns, for each lattice point in the bounding box of `nodes`, the nodes from which its displacement is
/// interpolated. A window interpolates the displacements of a mesh from the lattice.
/// In      nodes  positions at rest in the body's frame, in any order; at least one
std::vector<NearPlaces> soft_lattice_nodes(std::span<const Vec3> nodes);

/// Encodes the displacements of the lattice points.
/// In      offsets_W  displacement of each point [m]; a displacement that is not finite counts as zero
void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out);
/// Returns the displacements of the lattice points [m]; nothing if their number is wrong or the quantum is out of
/// range.
std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& message);

}  // namespace tandem::proto
