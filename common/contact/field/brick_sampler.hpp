// Samples the distance to a mesh in one brick of a grid. Used only to build grids.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::contact {

inline constexpr int kBrickCells = 4;    ///< cells of the coarsest level along a brick's edge
inline constexpr int kFinestCells = 16;  ///< cells of the finest level along a brick's edge
/// Factor that allows for rounding: of two lengths that are equal in exact arithmetic, the larger one is at most this
/// many times the smaller one.
inline constexpr double kRounding = 1.001;
/// Largest magnitude of a sample, in quanta.
inline constexpr double kSampleSteps = std::numeric_limits<std::int16_t>::max();

/// Returns the exact distance that contact uses, from the surface of the mesh to a point in its frame S.
///
/// In      hint  index of the triangle found by a nearby query, or −1; replaced by the index of this query's triangle
using ExactDistance = std::function<double(const Vec3& p_S, int& hint)>;

/// Corrects wrong signs of distances. Wrong signs occur at a flaw of the mesh (a tiny fold), where a wrong
/// pseudo-normal exchanges inside and outside.
/// 1. Two neighbouring points must be on the same side of the surface if the sum of their distances exceeds their
///    separation.
/// 2. Points that are connected in this way get the sign that most of them have.
///
/// In      distances_m  on a lattice of `along` points, x fastest
///         apart_m      separation of neighbours plus the error of both distances
void settle_signs(std::span<float> distances_m, const std::array<std::size_t, 3>& along, double apart_m);

/// Position in a brick, in half cells of the finest level. The middles of all cells, faces and edges are such
/// positions.
using Halves = std::array<int, 3>;
inline constexpr int kBrickHalves = 2 * kFinestCells;

/// Trilinear interpolation on a lattice whose points are `step` half cells apart.
///
/// In      corner  returns the value at (x, y, z), in half cells
template <typename Corner>
double interpolated(const Halves& at, int step, const Corner& corner) {
  Halves low;
  std::array<double, 3> part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(at[axis], kBrickHalves - step) / step * step;
    part[axis] = static_cast<double>(at[axis] - low[axis]) / step;
  }
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto along_x = [&](int y, int z) { return mix(corner(low[0], y, z), corner(low[0] + step, y, z), part[0]); };
  const auto along_y = [&](int z) { return mix(along_x(low[1], z), along_x(low[1] + step, z), part[1]); };
  return mix(along_y(low[2]), along_y(low[2] + step), part[2]);
}

inline constexpr int step_of(std::uint32_t level) {
  return kBrickHalves / (kBrickCells << level);
}

/// A test position with its exact distance. The error of interpolation is measured there.
struct TestPoint {
  std::array<std::uint8_t, 3> at;  ///< position in the brick, in half cells
  float distance_m;
};

struct Brick {
  std::uint32_t index = 0;
  int hint = -1;
  std::uint32_t level = 0;
  std::vector<std::int16_t> samples;
  std::vector<TestPoint> tests;

  /// Returns the index of a sample at a position in halves, which are multiples of the level's step.
  std::size_t offset(int x, int y, int z) const {
    const int step = step_of(level);
    const int edge = kBrickHalves / step + 1;
    return static_cast<std::size_t>(((z / step) * edge + y / step) * edge + x / step);
  }
  /// Returns the interpolated distance at a position, in quanta.
  double interpolated_at(const Halves& at) const {
    return interpolated(at, step_of(level), [this](int x, int y, int z) { return samples[offset(x, y, z)]; });
  }
};

/// Samples `brick`, whose low corner is at `low_S`, at the coarsest level that is accurate enough. Exact distances are
/// computed only in cells where interpolation is inaccurate, which is where the surface is curved. All other finer
/// samples are interpolated from coarser ones.
///
/// In      brick  hint is set
/// Out     brick  level, samples (in quanta) and tests are set
void sample_brick(const ExactDistance& exact, const Vec3& low_S, double brick_m, double band_m, double tolerance_m,
                  double quantum_m, std::uint32_t levels, Brick& brick);

}  // namespace tandem::contact
