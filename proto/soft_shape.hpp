// How a soft block yields, as windows are told: the offsets of a lattice of points on the surface of its box.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "tandem/control.pb.h"

namespace tandem::proto {

inline constexpr std::size_t kSoftLatticeEdge = 8;
inline constexpr std::size_t kSoftLatticePoints = 8 * 8 * 8 - 6 * 6 * 6;

/// The points, as shares -0.5..0.5 of the box's edges, from its middle: x fastest, then y, then z.
const std::array<Vec3, kSoftLatticePoints>& soft_lattice();
/// Triangles over them, counter-clockwise seen from outside.
const std::vector<std::array<int, 3>>& soft_lattice_faces();

/// In      offsets_W  of each point [m]; what is not finite counts as none
void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out);
/// Nothing: not as many offsets, or a quantum out of range.
std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& told);

}  // namespace tandem::proto
