#include "client/view/molecular_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace tandem::client {
namespace {

constexpr double kSharpness = 1.2;
constexpr double kFinestGrid_angstrom = 0.4;
constexpr double kAtomsOnFinestGrid = 2000;
constexpr double kCoarsening = 1.3;
/// Smallest standard deviation of a Gaussian, in cells. A narrower Gaussian could be missed between the grid points.
constexpr double kMinWidth = 0.8;
/// Contributions of an atom to F are neglected where they are below this fraction of 1 (the surface is at F = 1).
constexpr double kNegligible = 0.01;
/// Smallest distance of a vertex from the faces of its cell, as a fraction of the cell's edge. It keeps the vertices of
/// neighbouring cells apart.
constexpr double kFaceMargin = 0.02;
constexpr int kNewtonSteps = 3;

constexpr int kBlockCells = 8;
/// Number of grid points of a block along each axis: one for each cell, one before the first cell and one after the
/// last.
constexpr int kPoints = kBlockCells + 2;
constexpr int kCells = kPoints - 1;

using Index3 = std::array<int, 3>;

/// One atom's term of F (molecular_surface.hpp): amplitude · exp(−steepness |x − centre|²).
struct Blob {
  Vec3 centre;
  double square_radius;
  double steepness;
  double amplitude;
  double reach;
  Rgba color;
};

/// Value and gradient of F at one point.
struct Sample {
  double value = 0;
  Vec3 gradient = Vec3::Zero();
  Rgba color{};
};

std::vector<Blob> blobs_of(const docking::Molecule& molecule, double grid, std::span<const Rgba> colors) {
  std::vector<Blob> blobs;
  blobs.reserve(molecule.size());
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    const double radius = van_der_waals_radius_angstrom(molecule, atom);
    const double width = kMinWidth * grid;
    const double sharpness = std::min(kSharpness, radius * radius / (2 * width * width));
    blobs.push_back({.centre = molecule.positions_angstrom[atom],
                     .square_radius = radius * radius,
                     .steepness = sharpness / (radius * radius),
                     .amplitude = std::exp(sharpness),
                     .reach = radius * std::sqrt((sharpness - std::log(kNegligible)) / sharpness),
                     .color = colors[atom]});
  }
  return blobs;
}

std::size_t place_of(int points, const Index3& at) {
  return static_cast<std::size_t>((at[2] * points + at[1]) * points + at[0]);
}

Index3 next(Index3 at, int axis, int steps = 1) {
  at.at(static_cast<std::size_t>(axis)) += steps;
  return at;
}

/// Values of F on one block of the grid, and the triangles that belong to its grid edges.
///
/// Neighbouring blocks share grid points at their borders. There must be no gaps between blocks, so the value at a
/// shared point is bit-identical in all of them. For this, each block adds the same atoms in the same order, at
/// coordinates that are computed in the same way.
class Block {
 public:
  Block(double grid, double scale) : grid_(grid), scale_(scale) {}

  void fill(const Index3& block, const std::vector<Blob>& blobs, const std::vector<std::uint32_t>& atoms);
  void append_to(DrawnMesh& out);

 private:
  double coordinate(int axis, int point) const {
    return grid_ * (kBlockCells * block_.at(static_cast<std::size_t>(axis)) - 1 + point);
  }
  Vec3 place(const Index3& at) const { return {coordinate(0, at[0]), coordinate(1, at[1]), coordinate(2, at[2])}; }
  double value(const Index3& at) const { return values_[place_of(kPoints, at)]; }
  bool is_inside(const Index3& at) const { return value(at) >= 1; }
  void add(const Blob& blob);
  void add_faces(DrawnMesh& out, const Index3& at, int axis);
  const Vertex& vertex(const Index3& cell);
  Vec3 mean_of_crossings(const Index3& cell) const;
  Sample sample(const Vec3& at) const;

  double grid_;
  double scale_;
  Index3 block_{};
  const std::vector<Blob>* blobs_ = nullptr;
  const std::vector<std::uint32_t>* atoms_ = nullptr;
  std::array<double, kPoints * kPoints * kPoints> values_{};
  std::array<int, kCells * kCells * kCells> vertex_of_{};  ///< index of each cell's vertex; −1: not computed yet
  std::vector<Vertex> vertices_;
  std::array<std::vector<double>, 3> centres_;
  mutable std::vector<double> squares_;
};

void Block::fill(const Index3& block, const std::vector<Blob>& blobs, const std::vector<std::uint32_t>& atoms) {
  block_ = block;
  blobs_ = &blobs;
  atoms_ = &atoms;
  values_.fill(0);
  vertex_of_.fill(-1);
  vertices_.clear();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    centres_[axis].clear();
    for (const std::uint32_t atom : atoms) centres_[axis].push_back(blobs[atom].centre[static_cast<int>(axis)]);
  }
  squares_.resize(atoms.size());
  for (const std::uint32_t atom : atoms) add(blobs[atom]);
}

/// Adds the Gaussian of an atom to the values of the grid. The Gaussian is a product of one factor for each axis, so
/// few exponentials must be computed.
void Block::add(const Blob& blob) {
  std::array<std::array<double, kPoints>, 3> factors{};
  Index3 first{}, last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = kPoints;
    last[axis] = -1;
    for (int point = 0; point < kPoints; ++point) {
      const double apart = coordinate(static_cast<int>(axis), point) - blob.centre[static_cast<int>(axis)];
      if (std::abs(apart) > blob.reach) continue;
      first[axis] = std::min(first[axis], point);
      last[axis] = point;
      factors[axis].at(static_cast<std::size_t>(point)) = std::exp(-blob.steepness * apart * apart);
    }
    if (last[axis] < 0) return;
  }
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      const double factor =
          blob.amplitude * factors[2].at(static_cast<std::size_t>(z)) * factors[1].at(static_cast<std::size_t>(y));
      double* const row = &values_[place_of(kPoints, {0, y, z})];
      for (int x = first[0]; x <= last[0]; ++x) row[x] += factor * factors[0][static_cast<std::size_t>(x)];
    }
  }
}

/// Appends the triangles of all grid edges that start at a point of this block.
void Block::append_to(DrawnMesh& out) {
  const auto is_inside_value = [](double value) { return value >= 1; };
  if (std::ranges::none_of(values_, is_inside_value) || std::ranges::all_of(values_, is_inside_value)) return;
  for (int z = 1; z <= kBlockCells; ++z) {
    for (int y = 1; y <= kBlockCells; ++y) {
      for (int x = 1; x <= kBlockCells; ++x) {
        for (int axis = 0; axis < 3; ++axis) add_faces(out, {x, y, z}, axis);
      }
    }
  }
}

/// If the surface crosses a grid edge, appends the quadrilateral between the vertices of the four cells around it. The
/// quadrilateral is split into triangles along its shorter diagonal.
void Block::add_faces(DrawnMesh& out, const Index3& at, int axis) {
  const bool is_leaving = is_inside(at);
  if (is_leaving == is_inside(next(at, axis))) return;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  // Counter-clockwise about the axis. Vertices are copied, because references would become invalid if vertices_ grows.
  std::array<Vertex, 4> corners{vertex(next(next(at, u, -1), v, -1)), vertex(next(at, v, -1)), vertex(at),
                                vertex(next(at, u, -1))};
  if (!is_leaving) std::swap(corners[1], corners[3]);
  const auto length = [&corners](std::size_t a, std::size_t b) {
    float sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const float apart = corners.at(a).position_m[i] - corners.at(b).position_m[i];
      sum += apart * apart;
    }
    return sum;
  };
  const std::size_t first = length(0, 2) <= length(1, 3) ? 0 : 1;
  for (const std::size_t corner : {0, 1, 2, 0, 2, 3}) out.push_back(corners.at((first + corner) % 4));
}

Vec3 Block::mean_of_crossings(const Index3& cell) const {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 4; ++i) {
      const Index3 from = next(next(cell, (axis + 1) % 3, i % 2), (axis + 2) % 3, i / 2);
      const Index3 to = next(from, axis);
      if (is_inside(from) == is_inside(to)) continue;
      const double share = (1 - value(from)) / (value(to) - value(from));
      sum += place(from) + share * (place(to) - place(from));
      ++count;
    }
  }
  return sum / count;
}

/// Returns the vertex of a cell. It is computed at the first call, by Newton's method. The method is applied to log F
/// instead of F, because log F is quadratic near an isolated atom.
const Vertex& Block::vertex(const Index3& cell) {
  int& index = vertex_of_[place_of(kCells, cell)];
  if (index >= 0) return vertices_[static_cast<std::size_t>(index)];
  index = static_cast<int>(vertices_.size());
  const Vec3 low = place(cell).array() + kFaceMargin * grid_;
  const Vec3 high = place(cell).array() + (1 - kFaceMargin) * grid_;
  Vec3 at = mean_of_crossings(cell).cwiseMax(low).cwiseMin(high);
  Sample here = sample(at);
  for (int step = 0; step < kNewtonSteps && here.gradient.squaredNorm() > 0; ++step) {
    at -= std::log(here.value) * here.value / here.gradient.squaredNorm() * here.gradient;
    at = at.cwiseMax(low).cwiseMin(high).eval();
    here = sample(at);
  }
  const Vec3 normal = -here.gradient.normalized();
  Vertex& made = vertices_.emplace_back();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    made.position_m[axis] = static_cast<float>(scale_ * at[static_cast<int>(axis)]);
    made.normal[axis] = static_cast<float>(normal[static_cast<int>(axis)]);
  }
  made.color = bytes_of(here.color);
  return made;
}

/// Weight of an atom's colour at a vertex. It decreases with the distance, does not depend on the grid, and is never 0.
/// In      square  squared distance, in units of the atom's squared radius
double color_weight(double square) {
  const double near = 1 / std::max(square, 1e-9);
  const double fourth = near * near * near * near;
  return fourth * fourth;
}

/// Returns F, its gradient and the mixed colour at a point. First, all distances are computed in a loop that compilers
/// can vectorise. Then only the few atoms near enough to contribute are evaluated.
Sample Block::sample(const Vec3& at) const {
  const double x = at.x(), y = at.y(), z = at.z();
  for (std::size_t i = 0; i < squares_.size(); ++i) {
    const double dx = centres_[0][i] - x, dy = centres_[1][i] - y, dz = centres_[2][i] - z;
    squares_[i] = dx * dx + dy * dy + dz * dz;
  }
  Sample sum;
  double weights = 0;
  for (std::size_t i = 0; i < squares_.size(); ++i) {
    const Blob& blob = (*blobs_)[(*atoms_)[i]];
    if (squares_[i] > blob.reach * blob.reach) continue;
    const double part = blob.amplitude * std::exp(-blob.steepness * squares_[i]);
    const double weight = color_weight(squares_[i] / blob.square_radius);
    sum.value += part;
    sum.gradient -= 2 * blob.steepness * part * (at - blob.centre);
    weights += weight;
    for (std::size_t k = 0; k < 4; ++k) sum.color[k] += static_cast<float>(weight) * blob.color[k];
  }
  for (float& share : sum.color) share /= static_cast<float>(weights);
  return sum;
}

/// Returns, for each block, the atoms that contribute to its values. Each atom is assumed to reach one cell further
/// than it does, so that the neighbours of all reached grid points are included.
std::map<Index3, std::vector<std::uint32_t>> blocks_of(const std::vector<Blob>& blobs, double grid,
                                                       const std::stop_token& stop) {
  std::map<Index3, std::vector<std::uint32_t>> blocks;
  for (std::size_t atom = 0; atom < blobs.size() && !stop.stop_requested(); ++atom) {
    Index3 first{}, last{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double centre = blobs[atom].centre[static_cast<int>(axis)] / grid, reach = blobs[atom].reach / grid + 1;
      first[axis] = static_cast<int>(std::ceil((centre - reach - kBlockCells) / kBlockCells));
      last[axis] = static_cast<int>(std::floor((centre + reach + 1) / kBlockCells));
    }
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) blocks[{x, y, z}].push_back(static_cast<std::uint32_t>(atom));
      }
    }
  }
  return blocks;
}

/// Appends the surface, computed with the given grid spacing. Returns false if it would have more than `max_triangles`.
/// After a stop request, ends early and returns true.
bool append_on_grid(DrawnMesh& out, const std::vector<Blob>& blobs, double grid, double scale,
                    std::size_t max_triangles, const std::stop_token& stop) {
  const std::size_t before = out.size();
  Block block(grid, scale);
  for (const auto& [index, atoms] : blocks_of(blobs, grid, stop)) {
    if (stop.stop_requested()) return true;
    block.fill(index, blobs, atoms);
    block.append_to(out);
    if (out.size() - before > 3 * max_triangles) return false;
  }
  return true;
}

}  // namespace

void append_surface(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                    std::span<const Rgba> colors, std::size_t max_triangles, const std::stop_token& stop) {
  const std::size_t before = out.size();
  const double crowd = static_cast<double>(molecule.size()) / kAtomsOnFinestGrid;
  double grid = kFinestGrid_angstrom * std::cbrt(std::max(1.0, crowd));
  while (!append_on_grid(out, blobs_of(molecule, grid, colors), grid, metres_per_angstrom, max_triangles, stop)) {
    out.resize(before);
    grid *= kCoarsening;
  }
  if (stop.stop_requested()) out.resize(before);
}

}  // namespace tandem::client
