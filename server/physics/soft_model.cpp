#include "server/physics/soft_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace tandem::server {
namespace {

using Cells = std::array<std::uint64_t, 3>;

/// Indices and positions of a block's nodes.
class Lattice {
 public:
  Lattice(const Vec3& size_m, const Cells& cells) : size_m_(size_m) {
    for (std::size_t axis = 0; axis < 3; ++axis) cells_[axis] = static_cast<int>(cells[axis]);
  }

  int cells(int axis) const { return cells_[static_cast<std::size_t>(axis)]; }
  int node(int x, int y, int z) const { return (z * (cells_[1] + 1) + y) * (cells_[0] + 1) + x; }
  bool holds(int x, int y, int z) const {
    return x >= 0 && y >= 0 && z >= 0 && x <= cells_[0] && y <= cells_[1] && z <= cells_[2];
  }
  Vec3 place(int x, int y, int z) const {
    const Vec3 fraction(double(x) / cells_[0], double(y) / cells_[1], double(z) / cells_[2]);
    return (fraction.array() - 0.5).matrix().cwiseProduct(size_m_);
  }
  /// Returns the mass fraction of a node: 1 inside, halved for each side of the block on which the node lies.
  double share(int x, int y, int z) const {
    const auto at_side = [](int i, int n) { return i == 0 || i == n ? 0.5 : 1.0; };
    return at_side(x, cells_[0]) * at_side(y, cells_[1]) * at_side(z, cells_[2]);
  }
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (int z = 0; z <= cells_[2]; ++z) {
      for (int y = 0; y <= cells_[1]; ++y) {
        for (int x = 0; x <= cells_[0]; ++x) visit(x, y, z);
      }
    }
  }

 private:
  Vec3 size_m_;
  std::array<int, 3> cells_{};
};

/// Offsets from a node to half of its 26 neighbours: along edges, face diagonals and space diagonals. With the opposite
/// offsets, each link would occur twice.
constexpr std::array<std::array<int, 3>, 13> kNeighbours{{{1, 0, 0},
                                                          {0, 1, 0},
                                                          {0, 0, 1},
                                                          {1, 1, 0},
                                                          {1, -1, 0},
                                                          {1, 0, 1},
                                                          {1, 0, -1},
                                                          {0, 1, 1},
                                                          {0, 1, -1},
                                                          {1, 1, 1},
                                                          {1, 1, -1},
                                                          {1, -1, 1},
                                                          {-1, 1, 1}}};

void add_links(const Lattice& lattice, SoftModel& model) {
  for (const auto& [dx, dy, dz] : kNeighbours) {
    lattice.for_each([&, dx = dx, dy = dy, dz = dz](int x, int y, int z) {
      if (!lattice.holds(x + dx, y + dy, z + dz)) return;
      model.links.push_back({lattice.node(x, y, z), lattice.node(x + dx, y + dy, z + dz)});
    });
  }
}

/// Adds two triangles for each cell on the side at the low or high end of `axis`. The diagonals alternate in direction,
/// so that none is favoured.
void add_side(const Lattice& lattice, int axis, bool is_high, SoftModel& model) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto node = [&](int i, int j) {
    std::array<int, 3> at{};
    at[static_cast<std::size_t>(axis)] = is_high ? lattice.cells(axis) : 0;
    at[static_cast<std::size_t>(u)] = i;
    at[static_cast<std::size_t>(v)] = j;
    return lattice.node(at[0], at[1], at[2]);
  };
  const auto add = [&](int a, int b, int c) {
    model.faces.push_back(is_high ? std::array<int, 3>{a, b, c} : std::array<int, 3>{a, c, b});
  };
  for (int i = 0; i < lattice.cells(u); ++i) {
    for (int j = 0; j < lattice.cells(v); ++j) {
      const int a = node(i, j), b = node(i + 1, j), c = node(i + 1, j + 1), d = node(i, j + 1);
      if ((i + j) % 2 == 0) {
        add(a, b, c);
        add(a, c, d);
      } else {
        add(a, b, d);
        add(b, c, d);
      }
    }
  }
}

/// Sorts the links into groups in which no two links share a node (graph colouring). With this order, a sweep is not
/// biased towards the start of the list.
void order_by_colour(SoftModel& model) {
  std::vector<std::vector<int>> taken(model.nodes_W.size());
  std::vector<std::pair<int, std::array<int, 2>>> coloured;
  for (const std::array<int, 2>& link : model.links) {
    auto& a = taken[static_cast<std::size_t>(link[0])];
    auto& b = taken[static_cast<std::size_t>(link[1])];
    int colour = 0;
    while (std::count(a.begin(), a.end(), colour) > 0 || std::count(b.begin(), b.end(), colour) > 0) ++colour;
    a.push_back(colour);
    b.push_back(colour);
    coloured.push_back({colour, link});
  }
  std::stable_sort(coloured.begin(), coloured.end(),
                   [](const auto& left, const auto& right) { return left.first < right.first; });
  for (std::size_t i = 0; i < coloured.size(); ++i) model.links[i] = coloured[i].second;
}

/// Anchors the nodes at the anchored sides of the body, up to a distance of 1 % of the body's size. Requires node
/// positions in the body's frame.
void anchor(SoftModel& model, SoftSides sides) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3& node : model.nodes_W) {
    low = low.cwiseMin(node);
    high = high.cwiseMax(node);
  }
  const double reach = 0.01 * (high - low).maxCoeff();
  for (std::size_t i = 0; i < model.nodes_W.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_low = model.nodes_W[i][axis] <= low[axis] + reach;
      const bool is_high = model.nodes_W[i][axis] >= high[axis] - reach;
      const bool is_glued =
          (is_low && (sides >> (2 * axis) & 1) != 0) || (is_high && (sides >> (2 * axis + 1) & 1) != 0);
      if (is_glued) model.mass_kg[i] = 0;
    }
  }
}

void scale_mass(SoftModel& model, double mass_kg) {
  double sum = 0;
  for (const double share : model.mass_kg) sum += share;
  for (double& share : model.mass_kg) share *= mass_kg / sum;
}

/// Samples a surface at a spacing of at most `spacing_m`. The order is: nodes, points on edges, points inside
/// triangles.
class Sampler {
 public:
  Sampler(const SoftModel& model, double spacing_m) : model_(model), spacing_m_(spacing_m) {}

  std::vector<SoftSample> samples() {
    add_nodes();
    for (const auto& face : model_.faces) {
      for (std::size_t i = 0; i < 3; ++i) add_edge(face[i], face[(i + 1) % 3]);
    }
    for (const auto& face : model_.faces) add_inside(face);
    return std::move(samples_);
  }

 private:
  void add_nodes() {
    std::vector<bool> is_on_surface(model_.nodes_W.size(), false);
    for (const auto& face : model_.faces) {
      for (const int node : face) is_on_surface[static_cast<std::size_t>(node)] = true;
    }
    for (std::size_t i = 0; i < is_on_surface.size(); ++i) {
      const int node = static_cast<int>(i);
      if (is_on_surface[i]) samples_.push_back({{node, node, node}, {1, 0, 0}});
    }
  }
  double length(int a, int b) const {
    return (model_.nodes_W[static_cast<std::size_t>(a)] - model_.nodes_W[static_cast<std::size_t>(b)]).norm();
  }
  int parts(double length_m) const {
    return std::max(1, static_cast<int>(std::ceil(length_m / (std::sqrt(2.0) * spacing_m_))));
  }
  void add_edge(int a, int b) {
    // Each edge occurs twice in the faces, once in each direction. It is sampled only in the direction a < b.
    if (a > b) return;
    const int n = parts(length(a, b));
    for (int i = 1; i < n; ++i) samples_.push_back({{a, b, b}, {1.0 - double(i) / n, double(i) / n, 0}});
  }
  void add_inside(const std::array<int, 3>& face) {
    const double longest = std::max({length(face[0], face[1]), length(face[1], face[2]), length(face[2], face[0])});
    const int n = parts(longest);
    for (int i = 1; i < n; ++i) {
      for (int j = 1; i + j < n; ++j) {
        samples_.push_back({face, {1.0 - double(i + j) / n, double(i) / n, double(j) / n}});
      }
    }
  }

  const SoftModel& model_;
  double spacing_m_;
  std::vector<SoftSample> samples_;
};

void add_samples(SoftModel& model) {
  double area_m2 = 0;
  for (const auto& face : model.faces) {
    const auto at = [&](std::size_t i) { return model.nodes_W[static_cast<std::size_t>(face[i])]; };
    area_m2 += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  // Estimates the spacing at which the limit of samples is reached. In a square grid with the side √2 · spacing, each
  // sample has an area of 2 · spacing².
  double spacing_m = std::max(kSoftSampleSpacing_m, std::sqrt(0.5 * area_m2 / double(kMaxSoftSamples)));
  do {
    model.samples = Sampler(model, spacing_m).samples();
    spacing_m *= 1.2;
  } while (model.samples.size() > kMaxSoftSamples + model.nodes_W.size());
}

SoftModel finished(SoftModel model, const SoftTraits& traits) {
  scale_mass(model, traits.mass_kg);
  anchor(model, traits.anchored);
  order_by_colour(model);
  for (Vec3& node : model.nodes_W) node = traits.X_WS * node;
  add_samples(model);
  model.traits = traits;
  return model;
}

}  // namespace

std::array<std::uint64_t, 3> soft_block_cells(const Vec3& size_m, double spacing_m) {
  Cells cells{};
  for (int axis = 0; axis < 3; ++axis) {
    // The tolerance 1e-9 prevents an additional cell by rounding if the size is a multiple of the spacing.
    const double count = std::clamp(std::ceil(size_m[axis] / spacing_m - 1e-9), 1.0, 1e6);
    cells[static_cast<std::size_t>(axis)] = static_cast<std::uint64_t>(count);
  }
  return cells;
}

std::uint64_t soft_block_nodes(const std::array<std::uint64_t, 3>& cells) {
  return (cells[0] + 1) * (cells[1] + 1) * (cells[2] + 1);
}

SoftModel make_soft_block(const Vec3& size_m, double spacing_m, const SoftTraits& traits) {
  const Lattice lattice(size_m, soft_block_cells(size_m, spacing_m));
  SoftModel model;
  lattice.for_each([&](int x, int y, int z) {
    model.nodes_W.push_back(lattice.place(x, y, z));
    model.mass_kg.push_back(lattice.share(x, y, z));
  });
  add_links(lattice, model);
  for (int axis = 0; axis < 3; ++axis) {
    add_side(lattice, axis, false, model);
    add_side(lattice, axis, true, model);
  }
  return finished(std::move(model), traits);
}

SoftModel make_soft_surface(const geometry::TriangleMesh& mesh, const SoftTraits& traits) {
  SoftModel model;
  model.nodes_W = mesh.vertices;
  model.faces = mesh.triangles;
  model.mass_kg.assign(mesh.vertices.size(), 0.0);
  // By edge: the corner opposite to the edge, in the first triangle that contains the edge.
  std::map<std::pair<int, int>, int> far_corner;
  for (const auto& face : mesh.triangles) {
    const auto at = [&](std::size_t i) { return mesh.vertices[static_cast<std::size_t>(face[i])]; };
    const double area = 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (std::size_t i = 0; i < 3; ++i) {
      model.mass_kg[static_cast<std::size_t>(face[i])] += area / 3;
      const int a = face[i], b = face[(i + 1) % 3], far = face[(i + 2) % 3];
      const auto [seen, is_first] = far_corner.emplace(std::minmax(a, b), far);
      if (is_first) model.links.push_back({a, b});
      if (!is_first && seen->second != far) model.links.push_back({seen->second, far});
    }
  }
  return finished(std::move(model), traits);
}

double enclosed_volume_m3(const std::vector<Vec3>& nodes, const std::vector<std::array<int, 3>>& faces) {
  if (nodes.empty()) return 0;
  const Vec3 origin = nodes.front();
  double volume = 0;
  for (const auto& face : faces) {
    const auto at = [&](std::size_t i) -> Vec3 { return nodes[static_cast<std::size_t>(face[i])] - origin; };
    volume += at(0).dot(at(1).cross(at(2))) / 6;
  }
  return volume;
}

}  // namespace tandem::server
