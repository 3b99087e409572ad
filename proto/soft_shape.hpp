// Deformation of a soft body for display: offsets of a lattice of points on the surface of its box.
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

/// Returns the points as shares -0.5..0.5 of the box's edges, from its middle: x fastest, then y, then z.
const std::array<Vec3, kSoftLatticePoints>& soft_lattice();
/// Returns the triangles of the lattice, counter-clockwise seen from outside.
const std::vector<std::array<int, 3>>& soft_lattice_faces();

/// Indices and weights of up to four places nearest to a point; weights ∝ 1 / distance with sum 1. With fewer than four
/// places the rest has weight 0.
using NearPlaces = std::array<std::pair<std::size_t, double>, 4>;
NearPlaces places_near(const Vec3& at, std::span<const Vec3> places);
/// Returns, for each lattice point in the bounding box of `nodes`, the nodes from which its offset is interpolated. A
/// window displays a mesh by these offsets.
/// In      nodes  at rest, in the body's frame; any order, at least one
std::vector<NearPlaces> soft_lattice_nodes(std::span<const Vec3> nodes);

/// In      offsets_W  offset of each point [m]; a non-finite one counts as zero
void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out);
/// Returns nothing for a wrong number of offsets or a quantum out of range.
std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& message);

}  // namespace tandem::proto
