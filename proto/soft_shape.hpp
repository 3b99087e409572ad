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

/// Returns the lattice points, in units of the box's edges and relative to its centre: −0.5..0.5 in each direction. In
/// the order of the points, x varies fastest, then y.
const std::array<Vec3, kSoftLatticePoints>& soft_lattice();
/// Returns the triangles of the lattice, counter-clockwise when seen from outside.
const std::vector<std::array<int, 3>>& soft_lattice_faces();

/// The up to four positions that are nearest to a point, each with its index and its weight for interpolation. Weights
/// are proportional to 1 / distance, and their sum is 1. If there are fewer than four positions, the other weights are
/// 0.
using NearPlaces = std::array<std::pair<std::size_t, double>, 4>;
NearPlaces places_near(const Vec3& at, std::span<const Vec3> places);
/// Returns the nodes and weights from which the displacement of each lattice point is interpolated. The lattice lies on
/// the bounding box of `nodes`. In the reverse direction, a window interpolates a mesh's displacements from the
/// lattice.
/// In      nodes  positions at rest in the body's frame, in any order; at least one
std::vector<NearPlaces> soft_lattice_nodes(std::span<const Vec3> nodes);

/// Encodes the displacements of the lattice points.
/// In      offsets_W  displacement of each lattice point [m]; one that is not finite is written as zero
void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out);
/// Returns the displacements of the lattice points [m]; nothing if their number is wrong or the quantum is out of
/// range.
std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& message);

}  // namespace tandem::proto
