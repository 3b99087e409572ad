#include "client/view/drawn_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace tandem::client {
namespace {

/// Of the angle up to which neighbouring faces are one smooth surface.
const double kSmoothCosine = std::cos(40 * std::numbers::pi / 180);
/// Balls of molecules with more atoms than this are made of fewer triangles.
constexpr std::size_t kFineAtoms = 1500;
/// Those of more than this are octahedra with the light of a ball, and sticks have few sides: each is some pixels wide.
constexpr std::size_t kCoarseAtoms = 20'000;
constexpr int kSides = 20, kCoarseSides = 5;

constexpr Rgba kWhite{1, 1, 1, 1};

std::array<float, 3> floats_of(const Vec3& a) {
  return {static_cast<float>(a.x()), static_cast<float>(a.y()), static_cast<float>(a.z())};
}

/// The faces around each vertex, and their normals times twice their area.
struct Faces {
  explicit Faces(const geometry::TriangleMesh& mesh) : around(mesh.vertices.size()) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& corners = mesh.triangles[i];
      const bool is_whole = std::ranges::all_of(corners, [&mesh](int corner) {
        return corner >= 0 && static_cast<std::size_t>(corner) < mesh.vertices.size();
      });
      normals.push_back(is_whole ? normal_of(mesh, corners) : Vec3(0, 0, 0));
      if (!is_whole || normals.back().squaredNorm() <= 0) continue;
      for (const int corner : corners) around[static_cast<std::size_t>(corner)].push_back(i);
    }
  }

  static Vec3 normal_of(const geometry::TriangleMesh& mesh, const std::array<int, 3>& corners) {
    const auto at = [&](int corner) { return mesh.vertices[static_cast<std::size_t>(corners[corner])]; };
    return (at(1) - at(0)).cross(at(2) - at(0));
  }

  /// Of the surface, at a corner of a face.
  Vec3 smooth_normal(std::size_t vertex, std::size_t face) const {
    Vec3 sum = Vec3::Zero();
    const Vec3 own = normals[face].normalized();
    for (const std::size_t other : around[vertex]) {
      if (normals[other].normalized().dot(own) >= kSmoothCosine) sum += normals[other];
    }
    return sum.normalized();
  }

  std::vector<std::vector<std::size_t>> around;
  std::vector<Vec3> normals;
};

/// A ball of radius 1: an octahedron, its edges halved so often.
geometry::TriangleMesh ball(int halvings) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int i = 0; i < halvings; ++i) {
    geometry::TriangleMesh finer{.vertices = mesh.vertices, .triangles = {}};
    const auto middle = [&finer](int a, int b) {
      finer.vertices.push_back(
          (finer.vertices[static_cast<std::size_t>(a)] + finer.vertices[static_cast<std::size_t>(b)]).normalized());
      return static_cast<int>(finer.vertices.size()) - 1;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const std::array<int, 3>& part : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
        finer.triangles.push_back(part);
      }
    }
    mesh = std::move(finer);
  }
  return mesh;
}

/// Source  radii: Bondi, J. Phys. Chem. 68, 441 (1964); hydrogen: Rowland and Taylor, J. Phys. Chem. 100, 7384 (1996)
struct Element {
  double mass_u;
  double radius_angstrom;
  double covalent_angstrom;
  Rgba color;
  bool is_carbon = false;
};

const Element& element_of(double mass_u) {
  static const std::array<Element, 6> kElements{{{1.008, 1.10, 0.31, {0.93F, 0.93F, 0.93F, 1}},
                                                 {12.011, 1.70, 0.76, {}, true},
                                                 {14.007, 1.55, 0.71, {0.10F, 0.35F, 0.85F, 1}},
                                                 {15.999, 1.52, 0.66, {0.84F, 0.18F, 0.10F, 1}},
                                                 {30.974, 1.80, 1.07, {0.90F, 0.45F, 0.05F, 1}},
                                                 {32.06, 1.80, 1.05, {0.93F, 0.82F, 0.20F, 1}}}};
  return *std::ranges::min_element(kElements, {}, [mass_u](const Element& e) { return std::abs(e.mass_u - mass_u); });
}

/// Triangles between the circles of two profile points about z; a radius of 0 is a tip.
void append_band(geometry::TriangleMesh& mesh, double low_radius, double low_z, double high_radius, double high_z,
                 int sides = kSides) {
  const auto first = static_cast<int>(mesh.vertices.size());
  for (int side = 0; side < sides; ++side) {
    const double angle = 2 * std::numbers::pi * side / sides;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    mesh.vertices.push_back(low_radius * out + low_z * Vec3::UnitZ());
    mesh.vertices.push_back(high_radius * out + high_z * Vec3::UnitZ());
  }
  for (int side = 0; side < sides; ++side) {
    const int a = first + 2 * side, b = first + 2 * ((side + 1) % sides);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
}

constexpr double kBallAngstrom = 0.42;
constexpr double kStickAngstrom = 0.18;
constexpr double kBondSlackAngstrom = 0.4;
constexpr double kMaxBondAngstrom = 2.6;

int halvings_for(const docking::Molecule& molecule, int fine) {
  if (molecule.size() <= kFineAtoms) return fine;
  return molecule.size() <= kCoarseAtoms ? 1 : 0;
}

/// In      unit  of radius 1
void append_ball(DrawnMesh& out, const DrawnMesh& unit, const Vec3& centre_m, double radius_m, const Rgba& color) {
  const std::array<std::uint8_t, 4> bytes = bytes_of(color);
  const std::array<float, 3> centre = floats_of(centre_m);
  for (Vertex vertex : unit) {
    vertex.normal = vertex.position_m;
    for (std::size_t i = 0; i < 3; ++i) {
      vertex.position_m[i] = centre[i] + static_cast<float>(radius_m) * vertex.position_m[i];
    }
    vertex.color = bytes;
    out.push_back(vertex);
  }
}

void append_stick(DrawnMesh& out, const Vec3& from, const Vec3& to, double radius_m, int sides, const Rgba& color) {
  geometry::TriangleMesh mesh;
  append_band(mesh, radius_m, 0, radius_m, (to - from).norm(), sides);
  append_mesh(out, mesh, {from, Quat::FromTwoVectors(Vec3::UnitZ(), to - from)}, color);
}

/// Atoms by cells of the longest bond, so that the cost is linear.
std::vector<std::pair<std::size_t, std::size_t>> bonds_of(const docking::Molecule& molecule) {
  using Cell = std::array<int, 3>;
  const auto cell_of = [&molecule](std::size_t atom) -> Cell {
    const Vec3 cell = (molecule.positions_angstrom[atom] / kMaxBondAngstrom).array().floor();
    return {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())};
  };
  const auto is_bond = [&molecule](std::size_t a, std::size_t b) {
    const double reach = element_of(molecule.mass_u[a]).covalent_angstrom +
                         element_of(molecule.mass_u[b]).covalent_angstrom + kBondSlackAngstrom;
    const double apart = (molecule.positions_angstrom[a] - molecule.positions_angstrom[b]).norm();
    return apart > 0 && apart < std::min(reach, kMaxBondAngstrom);
  };
  std::map<Cell, std::vector<std::size_t>> cells;
  std::vector<std::pair<std::size_t, std::size_t>> bonds;
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    const Cell own = cell_of(atom);
    for (int i = 0; i < 27; ++i) {
      const auto near = cells.find({own[0] + i % 3 - 1, own[1] + i / 3 % 3 - 1, own[2] + i / 9 - 1});
      if (near == cells.end()) continue;
      for (const std::size_t other : near->second) {
        if (is_bond(atom, other)) bonds.emplace_back(other, atom);
      }
    }
    cells[own].push_back(atom);
  }
  return bonds;
}

}  // namespace

std::array<std::uint8_t, 4> bytes_of(const Rgba& color) {
  std::array<std::uint8_t, 4> result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = static_cast<std::uint8_t>(std::lround(std::clamp(color[i], 0.0F, 1.0F) * 255));
  }
  return result;
}

double van_der_waals_radius_angstrom(double mass_u) {
  return element_of(mass_u).radius_angstrom;
}

Rgba atom_color(double mass_u, const Rgba& carbon) {
  const Element& element = element_of(mass_u);
  return element.is_carbon ? carbon : element.color;
}

void append_mesh(DrawnMesh& out, const geometry::TriangleMesh& mesh, const Pose& X, const Rgba& color) {
  const Faces faces(mesh);
  const std::array<std::uint8_t, 4> bytes = bytes_of(color);
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    if (faces.normals[face].squaredNorm() <= 0) continue;
    for (const int corner : mesh.triangles[face]) {
      const auto vertex = static_cast<std::size_t>(corner);
      const Vec3 normal = faces.smooth_normal(vertex, face);
      out.push_back({floats_of(X * mesh.vertices[vertex]), floats_of(X.q * normal), bytes});
    }
  }
}

void append_molecule(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                     const Rgba& carbon) {
  DrawnMesh unit;
  append_mesh(unit, ball(halvings_for(molecule, 3)), Pose{}, kWhite);
  out.reserve(out.size() + molecule.size() * unit.size());
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    const double mass_u = molecule.mass_u[atom];
    append_ball(out, unit, molecule.positions_angstrom[atom] * metres_per_angstrom,
                van_der_waals_radius_angstrom(mass_u) * metres_per_angstrom, atom_color(mass_u, carbon));
  }
}

void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom, const Rgba& carbon) {
  DrawnMesh unit;
  append_mesh(unit, ball(halvings_for(molecule, 2)), Pose{}, kWhite);
  const auto color_of = [&](std::size_t atom) { return atom_color(molecule.mass_u[atom], carbon); };
  const auto at = [&](std::size_t atom) -> Vec3 { return molecule.positions_angstrom[atom] * metres_per_angstrom; };
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    append_ball(out, unit, at(atom), kBallAngstrom * metres_per_angstrom, color_of(atom));
  }
  const int sides = molecule.size() <= kCoarseAtoms ? kSides : kCoarseSides;
  for (const auto& [a, b] : bonds_of(molecule)) {
    const Vec3 middle = (at(a) + at(b)) / 2;
    append_stick(out, at(a), middle, kStickAngstrom * metres_per_angstrom, sides, color_of(a));
    append_stick(out, middle, at(b), kStickAngstrom * metres_per_angstrom, sides, color_of(b));
  }
}

void append_cone(DrawnMesh& out) {
  geometry::TriangleMesh mesh;
  append_band(mesh, 0, 0, 1, 0);
  append_band(mesh, 1, 0, 0, 1);
  append_mesh(out, mesh, Pose{}, kWhite);
}

}  // namespace tandem::client
