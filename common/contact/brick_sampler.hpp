// Samples of the distance to a mesh in one brick of a grid. Private to the building of grids.
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

inline constexpr int kBrickCells = 4;    ///< of the largest cells, along a brick's edge
inline constexpr int kFinestCells = 16;  ///< of the smallest; positions in bricks are counted in these
/// What is equal to a length in exact numbers is shorter than that many of it.
inline constexpr double kRounding = 1.001;
inline constexpr double kSampleSteps = std::numeric_limits<std::int16_t>::max();

/// Distance to the mesh as contact means it, at a place in its frame S.
///
/// In      hint  triangle of a query nearby, or −1; replaced by this query's
using ExactDistance = std::function<double(const Vec3& p_S, int& hint)>;

/// One pseudo-normal at a flaw of the mesh, a tiny fold, must not turn the space around it inside out. Two neighbours
/// farther from the surface, together, than from each other are on the same side of it; all that hangs together like
/// this takes the sign that most of it has.
///
/// In      distances_m  on a lattice, x fastest, of `along` points
///         apart_m      how far neighbours are from each other, and more by what their distances err
void settle_signs(std::span<float> distances_m, const std::array<std::size_t, 3>& along, double apart_m);

/// A position in a brick, in half smallest cells: every middle of a cell, of a face or of an edge has one.
using Halves = std::array<int, 3>;
inline constexpr int kBrickHalves = 2 * kFinestCells;

/// Trilinear interpolation on a lattice of `step` halves.
///
/// In      corner  value at (x, y, z), in halves
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

/// A place where the exact distance is known.
struct TestPoint {
  std::array<std::uint8_t, 3> at;  ///< halves
  float distance_m;
};

struct Brick {
  std::uint32_t index = 0;
  int hint = -1;
  std::uint32_t level = 0;
  std::vector<std::int16_t> samples;
  std::vector<TestPoint> tests;

  /// In halves, multiples of the level's step.
  std::size_t offset(int x, int y, int z) const {
    const int step = step_of(level);
    const int edge = kBrickHalves / step + 1;
    return static_cast<std::size_t>(((z / step) * edge + y / step) * edge + x / step);
  }
  /// In quanta.
  double interpolated_at(const Halves& at) const {
    return interpolated(at, step_of(level), [this](int x, int y, int z) { return samples[offset(x, y, z)]; });
  }
};

/// Samples `brick`, whose low corner is at `low_S`, down to the coarsest level that is good enough: ever finer where
/// interpolation is not good enough in the middle of a cell. Elsewhere the finer samples are what the coarser ones
/// interpolate to, so that the work is where the surface bends.
///
/// In      brick  its hint
/// Out     brick  level, samples in quanta, tests
void sample_brick(const ExactDistance& exact, const Vec3& low_S, double brick_m, double band_m, double tolerance_m,
                  double quantum_m, std::uint32_t levels, Brick& brick);

}  // namespace tandem::contact
