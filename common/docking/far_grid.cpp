// See far_grid.hpp.
#include "common/docking/far_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace tandem::docking {
namespace {

using Nodes = float __attribute__((vector_size(16)));  ///< of q, of √C6, of √C12, nothing

struct Node {
  Nodes of;
};

constexpr double kFadeAngstrom = 8;
constexpr double kFinestAngstrom = 1, kCoarsestAngstrom = 3, kCoarser = 1.1;
/// Nodes times atoms, by which the spacing is chosen, the same on every machine.
constexpr double kMaxWork = 2.5e9;
/// 64 MB.
constexpr double kMaxNodes = 4e6;
/// Beside the faded ones, of which splines need one and the filter one.
constexpr std::size_t kBorder = 2;

/// 1 up to kFadeAngstrom before kFarReachAngstrom from the interval, 0 from there on.
double faded(double at, double low, double high) {
  const double beyond = std::max({low - at, at - high, 0.0});
  const double t = std::clamp((kFarReachAngstrom - beyond) / kFadeAngstrom, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Cubic B-splines at t in [0, 1) between the second and third of four nodes, and their derivatives.
struct Weights {
  std::array<float, 4> value, slope;

  explicit Weights(float t) {
    const float s = 1 - t;
    value = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
    slope = {-0.5F * s * s, (1.5F * t - 2) * t, (2 - 1.5F * s) * s, 0.5F * t * t};
  }
};

}  // namespace

class FarGrid {
 public:
  FarGrid(const Vec3& low, const Vec3& high, double spacing) : low_(low), high_(high), spacing_(spacing) {
    origin_ = low - Vec3::Constant(kFarReachAngstrom + kBorder * spacing);
    for (int axis = 0; axis < 3; ++axis) {
      const double length = high[axis] - origin_[axis] + kFarReachAngstrom;
      count_[axis] = static_cast<std::size_t>(std::ceil(length / spacing)) + kBorder + 1;
    }
    // Whole registers of the kernels.
    count_[0] = (count_[0] + kLanes - 1) / kLanes * kLanes;
  }

  bool is_affordable(std::size_t atoms) const {
    const auto nodes = static_cast<double>(size());
    return nodes <= kMaxNodes && nodes * static_cast<double>(atoms) <= kMaxWork;
  }
  std::size_t size() const { return count_[0] * count_[1] * count_[2]; }
  double spacing() const { return spacing_; }

  void fill(const Molecule& a, const FieldModel& model, const KernelModel& constants, FarRowKernel far_row) {
    nodes_.assign(size(), Node{});
    const Vec3 centre = 0.5 * (low_ + high_);
    // x y z c6 s3 q
    std::array<std::vector<float>, 6> atoms;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Vec3 at = a.positions_angstrom[i] - centre;
      const double cube = std::pow(a.sigma_angstrom[i], 3);
      const std::array<double, 6> of_atom{at.x(), at.y(),
                                          at.z(), 2 * std::sqrt(a.epsilon_kj_per_mol[i]) * cube,
                                          cube,   model.dielectric == Dielectric::kNone ? 0 : a.charge_e[i]};
      for (std::size_t k = 0; k < 6; ++k) atoms[k].push_back(static_cast<float>(of_atom[k]));
    }
    Target target;
    target.x = atoms[0].data();
    target.y = atoms[1].data();
    target.z = atoms[2].data();
    target.c6 = atoms[3].data();
    target.s3 = atoms[4].data();
    target.charge = atoms[5].data();
    std::vector<float> storage(3 * count_[0] + kLanes);
    float* const aligned = storage.data() + (64 - reinterpret_cast<std::uintptr_t>(storage.data()) % 64) % 64 / 4;
    for (std::size_t z = 0; z < count_[2]; ++z) {
      for (std::size_t y = 0; y < count_[1]; ++y) {
        fill_row(target, a.size(), constants, far_row, centre, y, z, aligned);
      }
    }
    filter();
  }

  void add(const Probes& b, std::span<const float> c6, std::span<const float> s3, FieldSums& sums) const noexcept {
    const double inverse = 1 / spacing_;
    for (std::size_t j = 0; j < b.count; ++j) {
      const double x = (b.x[j] - origin_.x()) * inverse, y = (b.y[j] - origin_.y()) * inverse,
                   z = (b.z[j] - origin_.z()) * inverse;
      if (!(is_inside(x, 0) && is_inside(y, 1) && is_inside(z, 2))) continue;
      ++sums.on_grid;
      const auto ix = static_cast<std::size_t>(x), iy = static_cast<std::size_t>(y), iz = static_cast<std::size_t>(z);
      const Weights wx(static_cast<float>(x - static_cast<double>(ix))),
          wy(static_cast<float>(y - static_cast<double>(iy))), wz(static_cast<float>(z - static_cast<double>(iz)));
      Nodes value = {}, by_x = {}, by_y = {}, by_z = {};
      for (std::size_t k = 0; k < 4; ++k) {
        Nodes plane = {}, plane_x = {}, plane_y = {};
        for (std::size_t l = 0; l < 4; ++l) {
          const Node* const p = nodes_.data() + index(ix - 1, iy + l - 1, iz + k - 1);
          const Nodes row =
              wx.value[0] * p[0].of + wx.value[1] * p[1].of + wx.value[2] * p[2].of + wx.value[3] * p[3].of;
          const Nodes row_x =
              wx.slope[0] * p[0].of + wx.slope[1] * p[1].of + wx.slope[2] * p[2].of + wx.slope[3] * p[3].of;
          plane += wy.value[l] * row;
          plane_x += wy.value[l] * row_x;
          plane_y += wy.slope[l] * row;
        }
        value += wz.value[k] * plane;
        by_x += wz.value[k] * plane_x;
        by_y += wz.value[k] * plane_y;
        by_z += wz.slope[k] * plane;
      }
      const Nodes factor = {b.charge[j], -c6[j], c6[j] * s3[j], 0};
      const Nodes energy = factor * value;
      sums.coulomb += static_cast<double>(energy[0]);
      sums.lennard_jones += static_cast<double>(energy[1]) + static_cast<double>(energy[2]);
      const auto force = [&](const Nodes& slope) {
        const Nodes f = factor * slope;
        return -inverse * (static_cast<double>(f[0]) + static_cast<double>(f[1]) + static_cast<double>(f[2]));
      };
      const double fx = force(by_x), fy = force(by_y), fz = force(by_z);
      sums.force[0] += fx;
      sums.force[1] += fy;
      sums.force[2] += fz;
      sums.torque[0] += b.arm_y[j] * fz - b.arm_z[j] * fy;
      sums.torque[1] += b.arm_z[j] * fx - b.arm_x[j] * fz;
      sums.torque[2] += b.arm_x[j] * fy - b.arm_y[j] * fx;
    }
  }

 private:
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const { return (z * count_[1] + y) * count_[0] + x; }
  bool is_inside(double at, std::size_t axis) const {
    return at >= 1 && at < static_cast<double>(count_[axis] - kBorder);
  }
  double coordinate(std::size_t i, int axis) const { return origin_[axis] + static_cast<double>(i) * spacing_; }

  void fill_row(const Target& target, std::size_t atoms, const KernelModel& constants, FarRowKernel far_row,
                const Vec3& centre, std::size_t y, std::size_t z, float* sums) {
    const double share = faded(coordinate(y, 1), low_.y(), high_.y()) * faded(coordinate(z, 2), low_.z(), high_.z());
    if (share == 0) return;
    const std::size_t count = count_[0];
    const std::array<float, 4> row{static_cast<float>(origin_.x() - centre.x()),
                                   static_cast<float>(coordinate(y, 1) - centre.y()),
                                   static_cast<float>(coordinate(z, 2) - centre.z()), static_cast<float>(spacing_)};
    far_row(target, atoms, constants, row.data(), count, sums, sums + count, sums + 2 * count);
    for (std::size_t x = 0; x < count; ++x) {
      const auto here = static_cast<float>(share * faded(coordinate(x, 0), low_.x(), high_.x()));
      nodes_[index(x, y, z)].of = here * Nodes{sums[x], sums[count + x], sums[2 * count + x], 0};
    }
  }

  /// Node values to those of splines, so that cubic polynomials are met exactly.
  void filter() {
    const std::array<std::size_t, 3> stride{1, count_[0], count_[0] * count_[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t begin = 0; begin < size(); ++begin) {
        if (begin / stride[axis] % count_[axis] != 0) continue;
        Nodes before = nodes_[begin].of;
        for (std::size_t i = 1; i + 1 < count_[axis]; ++i) {
          Nodes& node = nodes_[begin + i * stride[axis]].of;
          const Nodes here = node;
          node = (8 * here - before - nodes_[begin + (i + 1) * stride[axis]].of) / 6;
          before = here;
        }
      }
    }
  }

  Vec3 low_, high_, origin_;
  double spacing_;
  std::array<std::size_t, 3> count_{};
  std::vector<Node> nodes_;
};

namespace {

/// All that a grid's values come from.
struct Source {
  std::vector<Vec3> positions_angstrom;
  std::vector<double> sigma_angstrom, epsilon_kj_per_mol, charge_e;
  FieldModel model;
  FarRowKernel far_row;

  bool operator==(const Source&) const = default;
};

/// One grid, for as long as anyone has it.
struct Made {
  explicit Made(Source of) : source(std::move(of)) {}

  const Source source;
  std::mutex mutex;  ///< of the rest; held while it is filled: who wants the same grid waits, nobody else does
  std::weak_ptr<const FarGrid> grid;
};

/// Of the whole process.
class Shelf {
 public:
  std::shared_ptr<Made> of(Source source) {
    const std::lock_guard lock(mutex_);
    // Whoever has one outside is making its grid; otherwise nobody else comes by it meanwhile.
    std::erase_if(made_, [](const auto& made) {
      if (made.use_count() != 1) return false;
      const std::lock_guard own(made->mutex);
      return made->grid.expired();
    });
    for (const auto& made : made_) {
      if (made->source == source) return made;
    }
    return made_.emplace_back(std::make_shared<Made>(std::move(source)));
  }

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<Made>> made_;
};

/// Without values; null where no spacing is affordable.
std::unique_ptr<FarGrid> empty_far_grid(const Molecule& a) {
  Vec3 low = a.positions_angstrom.front(), high = low;
  for (const Vec3& position : a.positions_angstrom) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  for (double spacing = kFinestAngstrom; spacing <= kCoarsestAngstrom; spacing *= kCoarser) {
    auto grid = std::make_unique<FarGrid>(low, high, spacing);
    if (grid->is_affordable(a.size())) return grid;
  }
  return nullptr;
}

}  // namespace

std::optional<double> far_grid_spacing_angstrom(const Molecule& a) {
  const auto grid = empty_far_grid(a);
  return grid == nullptr ? std::nullopt : std::optional(grid->spacing());
}

std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const FieldModel& model, const KernelModel& constants,
                                             FarRowKernel far_row) {
  static Shelf shelf;
  const std::shared_ptr<Made> made =
      shelf.of({a.positions_angstrom, a.sigma_angstrom, a.epsilon_kj_per_mol, a.charge_e, model, far_row});
  const std::lock_guard lock(made->mutex);
  if (std::shared_ptr<const FarGrid> same = made->grid.lock()) return same;
  std::shared_ptr<FarGrid> grid = empty_far_grid(a);
  if (grid == nullptr) return grid;
  grid->fill(a, model, constants, far_row);
  made->grid = grid;
  return grid;
}

double spacing_angstrom(const FarGrid& grid) {
  return grid.spacing();
}

std::size_t node_count(const FarGrid& grid) {
  return grid.size();
}

void add_far_field(const FarGrid& grid, const Probes& b, std::span<const float> c6, std::span<const float> s3,
                   FieldSums& sums) noexcept {
  grid.add(b, c6, s3, sums);
}

}  // namespace tandem::docking
