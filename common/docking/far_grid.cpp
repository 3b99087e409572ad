#include "common/docking/far_grid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <mutex>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace tandem::docking {
namespace {

using Box = Eigen::AlignedBox3d;
/// Values at a grid node: sums over A's atoms with the coefficients q, √C6 and √C12. The last float is unused.
using Node = Eigen::Vector4f;

constexpr double kFadeAngstrom = 8;
constexpr double kFinestAngstrom = 1, kCoarsestAngstrom = 3, kCoarser = 1.1;
/// Limits of nodes × atoms, the cost of filling the grid. The finest spacing whose cost is within kMaxWork is chosen.
/// If there is none, the coarsest spacing is used up to a cost of kMaxCoarsestWork. The limits are constants, so all
/// machines choose the same spacing.
constexpr double kMaxWork = 2.5e9, kMaxCoarsestWork = 6e9;
/// Limit of the number of nodes; a grid of this size needs 64 MB.
constexpr double kMaxNodes = 4e6;
/// Number of nodes that are added beyond the grid's range at each end. One of them is needed by the spline, and the
/// other by filter().
constexpr std::size_t kBorder = 2;

Box box_of(const Molecule& molecule) {
  Box box;
  for (const Vec3& position : molecule.positions_angstrom) box.extend(position);
  return box;
}

/// Gap between the molecules up to which all atoms of B must be on the grid, in the region where the potential is not
/// faded.
constexpr double kApproachAngstrom = 8;
constexpr double kReachStepAngstrom = 4;

/// Returns the factor by which the potential fades near the ends of the grid along one axis. The grid extends by
/// `reach` beyond the interval [low, high]. The factor is 1 until kFadeAngstrom before an end, and then falls smoothly
/// to 0.
double faded(double at, double low, double high, double reach) {
  const double beyond = std::max({low - at, at - high, 0.0});
  const double t = std::clamp((reach - beyond) / kFadeAngstrom, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Distance from all atoms from which on a node is interpolated from a coarser lattice, in spacings of that lattice. At
/// this distance, the interpolation with six nodes has a relative error of 2e-4 for r^−1 and 8e-4 for r^−2.
constexpr double kNearSpacings = 5;
/// Half of the width of the six nodes used by the interpolation, in spacings of the coarser lattice. All six nodes must
/// be outside the cut-off, because the potential within it is not a pure power of r.
constexpr double kHalfwaySpacings = 2.5;
/// Weights with which six equidistant nodes are interpolated at their midpoint.
/// Source  Lagrange's polynomial of degree 5
constexpr std::array<float, 6> kHalfway{3.0F / 256, -25.0F / 256, 150.0F / 256, 150.0F / 256, -25.0F / 256, 3.0F / 256};
/// A lattice with fewer nodes is not interpolated, because a coarser lattice would save no time.
constexpr std::size_t kFewNodes = 4096;

/// Writes the potential at each of `places` to the node of the same index.
using Potential = std::function<void(std::span<const Vec3> places, std::span<Node> nodes)>;

/// Returns a function that computes the potential of all atoms of A. `constants` must outlive this function. Positions
/// are converted to floats relative to `centre`, for precision.
Potential potential_of(const Molecule& a, const FieldModel& model, const KernelModel& constants,
                       FarPointsKernel far_points, const Vec3& centre) {
  // One array each for x, y, z, c6, s3 and charge of the atoms (see Target).
  std::array<std::vector<float>, 6> atoms;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3 at = a.positions_angstrom[i] - centre;
    const double cube = std::pow(a.sigma_angstrom[i], 3);
    const std::array<double, 6> of_atom{at.x(), at.y(),
                                        at.z(), 2 * std::sqrt(a.epsilon_kj_per_mol[i]) * cube,
                                        cube,   model.dielectric == Dielectric::kNone ? 0 : a.charge_e[i]};
    for (std::size_t k = 0; k < 6; ++k) atoms[k].push_back(static_cast<float>(of_atom[k]));
  }
  return
      [atoms = std::move(atoms), &constants, far_points, centre](std::span<const Vec3> places, std::span<Node> nodes) {
        Target target;
        target.x = atoms[0].data();
        target.y = atoms[1].data();
        target.z = atoms[2].data();
        target.c6 = atoms[3].data();
        target.s3 = atoms[4].data();
        target.charge = atoms[5].data();
        constexpr std::size_t kBlock = 4 * kLanes;
        alignas(64) std::array<std::array<float, kBlock>, 6> floats{};
        const std::array<const float*, 3> from{floats[0].data(), floats[1].data(), floats[2].data()};
        const std::array<float*, 3> to{floats[3].data(), floats[4].data(), floats[5].data()};
        for (std::size_t begin = 0; begin < places.size(); begin += kBlock) {
          const std::size_t count = std::min(kBlock, places.size() - begin);
          for (std::size_t i = 0; i < kBlock; ++i) {
            // The last block is padded with copies of its last position.
            const Vec3 at = places[begin + std::min(i, count - 1)] - centre;
            for (std::size_t axis = 0; axis < 3; ++axis)
              floats[axis][i] = static_cast<float>(at[static_cast<int>(axis)]);
          }
          far_points(target, atoms[0].size(), constants, kBlock, from.data(), to.data());
          for (std::size_t i = 0; i < count; ++i) nodes[begin + i] = Node(floats[3][i], floats[4][i], floats[5][i], 0);
        }
      };
}

/// A cubic lattice of nodes; the index along x varies fastest.
class Lattice {
 public:
  Lattice(const Vec3& origin, double spacing, const std::array<std::size_t, 3>& count)
      : origin_(origin), spacing_(spacing), count_(count) {}

  std::size_t size() const { return count_[0] * count_[1] * count_[2]; }
  double spacing() const { return spacing_; }
  const Vec3& origin() const { return origin_; }
  const std::array<std::size_t, 3>& count() const { return count_; }
  std::span<Node> nodes() { return nodes_; }
  std::span<const Node> nodes() const { return nodes_; }

  double coordinate(std::size_t i, int axis) const { return origin_[axis] + static_cast<double>(i) * spacing_; }

  /// Computes the potential at each node. Near an atom it is summed directly over all atoms; elsewhere it is
  /// interpolated from a coarser lattice.
  void fill(const Potential& potential, std::span<const Vec3> atoms, double cutoff_angstrom) {
    nodes_.assign(size(), Node::Zero());
    const std::vector<char> is_near = near_nodes(atoms, cutoff_angstrom);
    std::vector<Vec3> places;
    for (std::size_t n = 0; n < size(); ++n) {
      if (is_near[n] != 0) places.push_back(position(n));
    }
    if (places.size() < size()) {
      Lattice coarser = coarser_lattice();
      coarser.fill(potential, atoms, cutoff_angstrom);
      interpolate(coarser);
    }
    std::vector<Node> values(places.size());
    potential(places, values);
    std::size_t next = 0;
    for (std::size_t n = 0; n < size(); ++n) {
      if (is_near[n] != 0) nodes_[n] = values[next++];
    }
  }

  /// Converts node values to B-spline coefficients (see make_far_grid()). For a cubic polynomial, the resulting spline
  /// equals the polynomial exactly.
  void filter() {
    const std::array<std::size_t, 3> stride{1, count_[0], count_[0] * count_[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t begin = 0; begin < size(); ++begin) {
        if (begin / stride[axis] % count_[axis] != 0) continue;
        Node before = nodes_[begin];
        for (std::size_t i = 1; i + 1 < count_[axis]; ++i) {
          Node& node = nodes_[begin + i * stride[axis]];
          const Node here = node;
          node = (8 * here - before - nodes_[begin + (i + 1) * stride[axis]]) / 6;
          before = here;
        }
      }
    }
  }

 private:
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const { return (z * count_[1] + y) * count_[0] + x; }
  Vec3 position(std::size_t n) const {
    return {coordinate(n % count_[0], 0), coordinate(n / count_[0] % count_[1], 1),
            coordinate(n / count_[0] / count_[1], 2)};
  }

  /// Marks the nodes that must be summed directly: those near an atom, or all if a coarser lattice would save no time.
  std::vector<char> near_nodes(std::span<const Vec3> atoms, double cutoff_angstrom) const {
    std::vector<char> is_near(size(), size() < kFewNodes ? 1 : 0);
    if (size() < kFewNodes) return is_near;
    const double wide = 2 * spacing_;
    const double reach = std::max(cutoff_angstrom + kHalfwaySpacings * wide, kNearSpacings * wide);
    const double reach2 = reach * reach;
    for (const Vec3& atom : atoms) {
      std::array<std::size_t, 3> first{}, last{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double at = atom[static_cast<int>(axis)] - origin_[static_cast<int>(axis)];
        const auto most = static_cast<double>(count_[axis] - 1);
        first[axis] = static_cast<std::size_t>(std::clamp(std::ceil((at - reach) / spacing_), 0.0, most));
        last[axis] = static_cast<std::size_t>(std::clamp(std::floor((at + reach) / spacing_), 0.0, most));
      }
      for (std::size_t z = first[2]; z <= last[2]; ++z) {
        const double of_z = std::pow(coordinate(z, 2) - atom.z(), 2);
        for (std::size_t y = first[1]; y <= last[1]; ++y) {
          const double left = reach2 - of_z - std::pow(coordinate(y, 1) - atom.y(), 2);
          if (left < 0) continue;
          const double half = std::sqrt(left), at = atom.x() - origin_.x();
          const auto most = static_cast<double>(count_[0]);
          const auto begin = static_cast<std::size_t>(std::clamp(std::ceil((at - half) / spacing_), 0.0, most));
          const auto end = static_cast<std::size_t>(std::clamp(std::floor((at + half) / spacing_) + 1, 0.0, most));
          if (begin < end) std::fill(is_near.begin() + offset(begin, y, z), is_near.begin() + offset(end, y, z), 1);
        }
      }
    }
    return is_near;
  }
  std::ptrdiff_t offset(std::size_t x, std::size_t y, std::size_t z) const {
    return static_cast<std::ptrdiff_t>(index(x, y, z));
  }

  /// Returns an empty lattice with twice this spacing that contains all nodes that from_coarser() needs.
  Lattice coarser_lattice() const {
    const double wide = 2 * spacing_;
    std::array<std::size_t, 3> count{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      count[axis] = count_[axis] / 2 + 2 * kBorder + 2;
    }
    return {origin_ - Vec3::Constant(kBorder * wide), wide, count};
  }

  /// Calls use(index in the coarser lattice, weight) for each coarser node from which node i is interpolated along an
  /// axis. For an even i this is the node at the same position. For an odd i, which lies half-way between two coarser
  /// nodes, these are the six nearest nodes.
  template <class Use>
  static void from_coarser(std::size_t i, const Use& use) {
    const std::size_t below = kBorder + i / 2;
    if (i % 2 == 0) return use(below, 1.0F);
    for (std::size_t k = 0; k < kHalfway.size(); ++k) use(below + k - 2, kHalfway[k]);
  }

  /// Computes all nodes by interpolation from the coarser lattice, row by row.
  void interpolate(const Lattice& coarser) {
    std::vector<Node> row(coarser.count_[0]);
    for (std::size_t z = 0; z < count_[2]; ++z) {
      for (std::size_t y = 0; y < count_[1]; ++y) {
        std::ranges::fill(row, Node(Node::Zero()));
        from_coarser(z, [&](std::size_t at_z, float of_z) {
          from_coarser(y, [&](std::size_t at_y, float of_y) {
            const Node* const from = coarser.nodes_.data() + coarser.index(0, at_y, at_z);
            for (std::size_t x = 0; x < row.size(); ++x) row[x] += of_z * of_y * from[x];
          });
        });
        for (std::size_t x = 0; x < count_[0]; ++x) {
          Node& node = nodes_[index(x, y, z)];
          from_coarser(x, [&](std::size_t at_x, float of_x) { node += of_x * row[at_x]; });
        }
      }
    }
  }

  Vec3 origin_;
  double spacing_;
  std::array<std::size_t, 3> count_{};
  std::vector<Node> nodes_;
};

}  // namespace

class FarGrid {
 public:
  FarGrid(const Box& box, double spacing, double reach)
      : box_(box), reach_(reach), lattice_(lattice_about(box, spacing, reach)) {}

  bool is_affordable(std::size_t atoms, double work) const {
    const auto nodes = static_cast<double>(lattice_.size());
    return nodes <= kMaxNodes && nodes * static_cast<double>(atoms) <= work;
  }
  std::size_t size() const { return lattice_.size(); }
  double spacing() const { return lattice_.spacing(); }
  const GridNodes& nodes() const { return nodes_; }

  void fill(const Molecule& a, const FieldModel& model, const KernelModel& constants, FarPointsKernel far_points) {
    lattice_.fill(potential_of(a, model, constants, far_points, box_.center()), a.positions_angstrom,
                  model.cutoff_angstrom);
    fade();
    lattice_.filter();
    nodes_.nodes = lattice_.nodes().data()->data();
    nodes_.per_angstrom = 1 / lattice_.spacing();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      nodes_.count[axis] = lattice_.count()[axis];
      nodes_.origin[axis] = lattice_.origin()[static_cast<int>(axis)];
      nodes_.last[axis] = std::nextafter(static_cast<double>(nodes_.count[axis] - kBorder), 0.0);
    }
  }

 private:
  static Lattice lattice_about(const Box& box, double spacing, double reach) {
    const Vec3 origin = box.min() - Vec3::Constant(reach + kBorder * spacing);
    std::array<std::size_t, 3> count{};
    for (int axis = 0; axis < 3; ++axis) {
      const double length = box.max()[axis] - origin[axis] + reach;
      count[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(std::ceil(length / spacing)) + kBorder + 1;
    }
    return {origin, spacing, count};
  }

  void fade() {
    const std::array<std::size_t, 3>& count = lattice_.count();
    std::array<std::vector<double>, 3> share;
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < count[static_cast<std::size_t>(axis)]; ++i) {
        share[static_cast<std::size_t>(axis)].push_back(
            faded(lattice_.coordinate(i, axis), box_.min()[axis], box_.max()[axis], reach_));
      }
    }
    std::size_t n = 0;
    for (const double z : share[2]) {
      for (const double y : share[1]) {
        for (const double x : share[0]) lattice_.nodes()[n++] *= static_cast<float>(z * y * x);
      }
    }
  }

  Box box_;
  double reach_;
  Lattice lattice_;
  GridNodes nodes_;
};

namespace {

/// Key of a grid: all inputs that determine its values. These are positions, σ, ε and charges of A, the field model,
/// the kernel and the reach.
using Source = std::tuple<std::vector<Vec3>, std::vector<double>, std::vector<double>, std::vector<double>, FieldModel,
                          FarPointsKernel, double>;

/// Registry entry of one grid. Rooms own the grid; the entry has only a weak reference to it.
struct Made {
  explicit Made(Source initial) : source(std::move(initial)) {}

  const Source source;
  /// Protects `grid`. It is locked while the grid is filled, so that other requests for the same grid wait for the
  /// result.
  std::mutex mutex;
  std::weak_ptr<const FarGrid> grid;
};

/// Registry of the far grids in this process, so that equal inputs use one grid.
class Shelf {
 public:
  std::shared_ptr<Made> find_or_add(Source source) {
    const std::lock_guard lock(mutex_);
    // Removes entries whose grid no longer exists. An entry with use_count > 1 is kept: another thread uses it and may
    // be computing its grid. While mutex_ is locked, no other thread can obtain an entry.
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

/// Returns a grid whose nodes are not yet computed; null if even the coarsest spacing exceeds the cost limits.
std::unique_ptr<FarGrid> empty_far_grid(const Molecule& a) {
  const Box box = box_of(a);
  for (double spacing = kFinestAngstrom; spacing <= kCoarsestAngstrom; spacing *= kCoarser) {
    auto grid = std::make_unique<FarGrid>(box, spacing, kFarReachAngstrom);
    if (grid->is_affordable(a.size(), kMaxWork)) return grid;
  }
  auto coarsest = std::make_unique<FarGrid>(box, kCoarsestAngstrom, kFarReachAngstrom);
  return coarsest->is_affordable(a.size(), kMaxCoarsestWork) ? std::move(coarsest) : nullptr;
}

/// Returns the reach of the grid [Å], its length beyond the box around A's atoms. The reach is chosen such that no atom
/// of B is in the fading border while the molecules are in contact, unless kMaxNodes forbids such a large grid.
double reach_for(const Molecule& a, const Molecule& b, double spacing) {
  const Box box = box_of(b);
  double radius = 0;
  for (const Vec3& position : b.positions_angstrom) radius = std::max(radius, (position - box.center()).norm());
  const double wanted = 2 * radius + kApproachAngstrom + kFadeAngstrom;
  double reach = kFarReachAngstrom;
  while (reach < wanted && FarGrid(box_of(a), spacing, reach + kReachStepAngstrom).size() <= kMaxNodes) {
    reach += kReachStepAngstrom;
  }
  return reach;
}

}  // namespace

std::optional<double> far_grid_spacing_angstrom(const Molecule& a) {
  const auto grid = empty_far_grid(a);
  return grid == nullptr ? std::nullopt : std::optional(grid->spacing());
}

std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const Molecule& b, const FieldModel& model,
                                             const KernelModel& constants, FarPointsKernel far_points) {
  static Shelf shelf;
  const auto spacing = far_grid_spacing_angstrom(a);
  if (!spacing) return nullptr;
  const double reach = reach_for(a, b, *spacing);
  const std::shared_ptr<Made> made = shelf.find_or_add(
      {a.positions_angstrom, a.sigma_angstrom, a.epsilon_kj_per_mol, a.charge_e, model, far_points, reach});
  const std::lock_guard lock(made->mutex);
  if (std::shared_ptr<const FarGrid> same = made->grid.lock()) return same;
  const auto grid = std::make_shared<FarGrid>(box_of(a), *spacing, reach);
  grid->fill(a, model, constants, far_points);
  made->grid = grid;
  return grid;
}

double spacing_angstrom(const FarGrid& grid) {
  return grid.spacing();
}

std::size_t node_count(const FarGrid& grid) {
  return grid.size();
}

const GridNodes& nodes_of(const FarGrid& grid) {
  return grid.nodes();
}

}  // namespace tandem::docking
