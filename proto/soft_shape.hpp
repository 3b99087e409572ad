// How a soft body yields, as windows are told: the offsets of a lattice of points on the surface of its box.
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

/// The points, as shares -0.5..0.5 of the box's edges, from its middle: x fastest, then y, then z.
const std::array<Vec3, kSoftLatticePoints>& soft_lattice();
/// Triangles over them, counter-clockwise seen from outside.
const std::vector<std::array<int, 3>>& soft_lattice_faces();

/// Some places next to another, by their numbers, and their weights: ∝ 1 / distance, together 1. Of fewer than four places
/// the rest has weight 0.
using NearPlaces = std::array<std::pair<std::size_t, double>, 4>;
NearPlaces places_near(const Vec3& at, std::span<const Vec3> places);
/// For each point of the lattice, in the box that holds `nodes`, the nodes whose offsets are its own: what a window is told
/// of a mesh is how these move.
/// In      nodes  at rest, in the body's frame; any order, at least one
std::vector<NearPlaces> soft_lattice_nodes(std::span<const Vec3> nodes);

/// In      offsets_W  of each point [m]; what is not finite counts as none
void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out);
/// Nothing: not as many offsets, or a quantum out of range.
std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& told);

}  // namespace tandem::proto
