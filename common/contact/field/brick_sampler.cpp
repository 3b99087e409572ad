#include "common/contact/field/brick_sampler.hpp"

#include <cmath>
#include <utility>

namespace tandem::contact {
namespace {

constexpr int kEdge = kFinestCells + 1;

class BrickSampler {
 public:
  BrickSampler(const ExactDistance& exact, const Vec3& low_S, double brick_m, int hint, double band_m)
      : exact_(exact), low_S_(low_S), half_m_(brick_m / kBrickHalves), band_m_(band_m), hint_(hint) {
    for_lattice(step_of(0), [this](const Halves& at) { known(at) = measured(at); });
    is_bad_.fill(true);
  }

  /// Samples the brick at the coarsest level, then at finer ones until interpolation is accurate enough. Returns the
  /// level reached.
  std::uint32_t refine(std::uint32_t levels, double tolerance_m) {
    std::uint32_t level = 0;
    while (has_bad_cells(step_of(level), tolerance_m) && level + 1 < levels) sample(++level);
    if (is_contradictory_ && level + 1 == levels) resolve_signs(tolerance_m);
    return level;
  }

  std::vector<std::int16_t> quantised(std::uint32_t level, double quantum_m) const {
    const int step = step_of(level);
    const auto edge = static_cast<std::size_t>(kBrickHalves / step + 1);
    std::vector<std::int16_t> samples;
    samples.reserve(edge * edge * edge);
    for_lattice(step, [&](const Halves& at) {
      const double steps = std::clamp(known_m_[offset(at)] / quantum_m, -kSampleSteps, kSampleSteps);
      samples.push_back(static_cast<std::int16_t>(std::lround(steps)));
    });
    return samples;
  }

  std::vector<TestPoint> release_tests() { return std::move(tests_); }

 private:
  template <typename Visit>
  static void for_lattice(int step, const Visit& visit) {
    for (int z = 0; z <= kBrickHalves; z += step) {
      for (int y = 0; y <= kBrickHalves; y += step) {
        for (int x = 0; x <= kBrickHalves; x += step) visit({x, y, z});
      }
    }
  }
  static std::size_t offset(const Halves& at) {
    return static_cast<std::size_t>(((at[2] / 2) * kEdge + at[1] / 2) * kEdge + at[0] / 2);
  }
  float& known(const Halves& at) { return known_m_[offset(at)]; }
  float measured(const Halves& at) {
    return static_cast<float>(exact_(low_S_ + Vec3(at[0], at[1], at[2]) * half_m_, hint_));
  }
  double guess(const Halves& at, int step) const {
    return interpolated(at, step, [this](int x, int y, int z) { return known_m_[offset({x, y, z})]; });
  }

  static std::size_t cell_of(const Halves& at, int step) {
    const auto along = [step](int position) { return std::min(position, kBrickHalves - 1) / step; };
    const int cells = kBrickHalves / step;
    return static_cast<std::size_t>((along(at[2]) * cells + along(at[1])) * cells + along(at[0]));
  }
  /// Returns whether any of the up to eight cells around a position is bad, that is, interpolates inaccurately.
  bool is_at_bad_cell(const Halves& at, int step) const {
    for (int i = 0; i < 8; ++i) {
      Halves in_cell = at;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        in_cell[axis] = (i >> axis & 1) != 0 ? std::max(at[axis] - 1, 0) : std::min(at[axis], kBrickHalves - 1);
      }
      if (is_bad_[cell_of(in_cell, step)]) return true;
    }
    return false;
  }

  void sample(std::uint32_t level) {
    const int step = step_of(level);
    for_lattice(step, [&](const Halves& at) {
      const auto is_between = [&](int position) { return position % (2 * step) != 0; };
      const bool is_middle = is_between(at[0]) && is_between(at[1]) && is_between(at[2]);
      const bool is_new = is_between(at[0]) || is_between(at[1]) || is_between(at[2]);
      if (!is_new || (is_middle && is_tested_[cell_of(at, 2 * step)])) return;
      known(at) = is_at_bad_cell(at, 2 * step) ? measured(at) : static_cast<float>(guess(at, 2 * step));
    });
  }

  /// Finds the bad cells of a level: those where interpolation is too inaccurate. Only cells inside bad cells of the
  /// previous level are tested. The test points are the middles of cells. On the brick's border, the middles of faces
  /// are test points, too, because finer neighbour bricks interpolate there.
  bool has_bad_cells(int step, double tolerance_m) {
    const std::array<bool, kMaxCells> was_bad = is_bad_;
    is_bad_.fill(false);
    is_tested_.fill(false);
    bool has_bad = false;
    for_lattice(step / 2, [&](const Halves& at) {
      int middles = 0;
      int borders = 0;
      for (const int position : at) {
        middles += position % step != 0 ? 1 : 0;
        borders += position == 0 || position == kBrickHalves ? 1 : 0;
      }
      if (middles + borders < 3 || middles < 2) return;
      if (step != step_of(0) && !was_bad[cell_of(at, 2 * step)]) return;
      has_bad = is_bad_at(at, step, tolerance_m) || has_bad;
    });
    return has_bad;
  }

  bool is_bad_at(const Halves& at, int step, double tolerance_m) {
    // Half of the cell's diagonal. It bounds two values: the error of a distance that is interpolated in the cell, and
    // the distance from the cell's middle to any of its points.
    const double reach_m = 0.5 * std::sqrt(3.0) * step * half_m_;
    const double interpolated_m = guess(at, step);
    if (std::abs(interpolated_m) > band_m_ + 2 * reach_m) return false;
    const float exact_m = measured(at);
    if (std::abs(exact_m) <= band_m_) {
      const auto small = [](int position) { return static_cast<std::uint8_t>(position); };
      tests_.push_back({{small(at[0]), small(at[1]), small(at[2])}, exact_m});
    }
    const double error_m = std::abs(interpolated_m - exact_m);
    // Distances with correct signs have an error of at most this bound. If the error is larger, one of the signs is
    // wrong.
    const bool is_contradiction = error_m > kRounding * reach_m;
    is_contradictory_ = is_contradictory_ || is_contradiction;
    const bool is_bad = is_contradiction || (std::abs(exact_m) <= band_m_ + reach_m && error_m > tolerance_m);
    if (step == 2) return is_bad;
    if (at[0] % step != 0 && at[1] % step != 0 && at[2] % step != 0) {
      // The position is a sample of the next level.
      known(at) = exact_m;
      is_tested_[cell_of(at, step)] = true;
    }
    if (is_bad) mark_bad(at, step, error_m > kCrease * tolerance_m);
    return is_bad;
  }

  /// Marks a bad cell. If the error is as large as at a crease (where two surfaces are equally near), its neighbours
  /// are marked, too. The crease may pass through them without an error at their middles, where they are tested.
  void mark_bad(const Halves& at, int step, bool with_neighbours) {
    is_bad_[cell_of(at, step)] = true;
    if (!with_neighbours) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int side : {-step, step}) {
        Halves beside = at;
        beside[axis] += side;
        if (beside[axis] >= 0 && beside[axis] < kBrickHalves) is_bad_[cell_of(beside, step)] = true;
      }
    }
  }

  /// Corrects wrong signs of distances at the finest level.
  void resolve_signs(double tolerance_m) {
    const int step = 2;
    settle_signs(known_m_, {kEdge, kEdge, kEdge}, kRounding * step * half_m_ + 2 * tolerance_m);
    for (TestPoint& test : tests_) {
      const double interpolated_m = guess({test.at[0], test.at[1], test.at[2]}, step);
      if (std::abs(interpolated_m + test.distance_m) < std::abs(interpolated_m - test.distance_m))
        test.distance_m *= -1;
    }
  }

  /// Ratio of interpolation error to tolerance from which a crease is assumed in the cell. Found by trial on the bunny
  /// and on boxes.
  static constexpr double kCrease = 3.0;
  static constexpr std::size_t kMaxCells = 8 * 8 * 8;  ///< number of cells of a level that has a finer one

  const ExactDistance& exact_;
  Vec3 low_S_;
  double half_m_;
  double band_m_;
  int hint_;
  std::array<float, kEdge * kEdge * kEdge> known_m_;
  std::array<bool, kMaxCells> is_bad_;
  std::array<bool, kMaxCells> is_tested_;
  bool is_contradictory_ = false;
  std::vector<TestPoint> tests_;
};

}  // namespace

void settle_signs(std::span<float> distances_m, const std::array<std::size_t, 3>& along, double apart_m) {
  const std::array<std::size_t, 3> strides = {1, along[0], along[0] * along[1]};
  std::vector<bool> is_reached(distances_m.size(), false);
  std::vector<std::size_t> region;
  const auto grow_from = [&](std::size_t from) {
    const auto visit = [&](std::size_t to) {
      if (is_reached[to] || std::abs(distances_m[from]) + std::abs(distances_m[to]) <= apart_m) return;
      is_reached[to] = true;
      region.push_back(to);
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t position = from / strides[axis] % along[axis];
      if (position > 0) visit(from - strides[axis]);
      if (position + 1 < along[axis]) visit(from + strides[axis]);
    }
  };
  for (std::size_t start = 0; start < distances_m.size(); ++start) {
    if (is_reached[start]) continue;
    region.assign(1, start);
    is_reached[start] = true;
    for (std::size_t i = 0; i < region.size(); ++i) grow_from(region[i]);
    const auto negative =
        std::count_if(region.begin(), region.end(), [&](std::size_t point) { return distances_m[point] < 0; });
    const float sign = 2 * static_cast<std::size_t>(negative) > region.size() ? -1.0F : 1.0F;
    for (const std::size_t point : region) distances_m[point] = std::copysign(distances_m[point], sign);
  }
}

void sample_brick(const ExactDistance& exact, const Vec3& low_S, double brick_m, double band_m, double tolerance_m,
                  double quantum_m, std::uint32_t levels, Brick& brick) {
  BrickSampler sampler(exact, low_S, brick_m, brick.hint, band_m);
  brick.level = sampler.refine(levels, tolerance_m);
  brick.samples = sampler.quantised(brick.level, quantum_m);
  brick.tests = sampler.release_tests();
}

}  // namespace tandem::contact
