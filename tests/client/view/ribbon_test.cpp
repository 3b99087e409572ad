// Tests ribbons of molecular chains without a window: their position and width, and atoms that do not form a chain.
#include "client/view/ribbon.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace tandem::client {
namespace {

constexpr Rgba kRibbonYellow{1, 1, 0, 1}, kGrey{0.5F, 0.5F, 0.5F, 1};

Vec3 in_eigen(const std::array<float, 3>& a) {
  return {a[0], a[1], a[2]};
}

void add_atom(docking::Molecule& molecule, const std::string& name, const std::string& element, const Vec3& at,
              int residue, const std::string& chain = "A", const std::string& residue_name = "ALA") {
  molecule.positions_angstrom.push_back(at);
  molecule.mass_u.push_back(12.011);
  molecule.atom_names.push_back(name);
  molecule.elements.push_back(element);
  molecule.residue_names.push_back(residue_name);
  molecule.residue_ids.push_back(std::to_string(residue));
  molecule.chains.push_back(chain);
  molecule.segments.push_back(0);
}

/// Returns an α helix around the z axis, with 100° and 1.5 Å per residue. The α carbons are 2.3 Å from the axis; the
/// oxygens are displaced along it.
docking::Molecule helix(int residues) {
  docking::Molecule molecule;
  for (int i = 0; i < residues; ++i) {
    const double angle = i * 100 * std::numbers::pi / 180;
    const Vec3 alpha(2.3 * std::cos(angle), 2.3 * std::sin(angle), 1.5 * i);
    add_atom(molecule, "CA", "C", alpha, i);
    add_atom(molecule, "O", "O", alpha + Vec3(0, 0, 2.4), i);
  }
  return molecule;
}

/// Returns a zigzag strand along the x axis, with 3.3 Å per residue. The α carbons are alternately at z = 0.9 and
/// −0.9 Å; the oxygens are displaced alternately in y.
docking::Molecule strand(int residues) {
  docking::Molecule molecule;
  for (int i = 0; i < residues; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    const Vec3 alpha(3.3 * i, 0, 0.9 * side);
    add_atom(molecule, "CA", "C", alpha, i);
    add_atom(molecule, "O", "O", alpha + Vec3(1.6, 2.0 * side, 0), i);
  }
  return molecule;
}

/// Returns the ribbon with coordinates in Å.
DrawnMesh ribbon_of(const docking::Molecule& molecule) {
  DrawnMesh out;
  append_ribbon(out, molecule, 1, std::vector<Rgba>(molecule.size(), kRibbonYellow));
  return out;
}

/// Returns the half extents in y and z of the vertices whose x is within 0.5 Å of `x`.
Eigen::Vector2d half_size_at(const DrawnMesh& mesh, double x) {
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Vertex& vertex : mesh) {
    const Vec3 at = in_eigen(vertex.position_m);
    if (std::abs(at.x() - x) > 0.5) continue;
    low = low.cwiseMin(at.tail<2>());
    high = high.cwiseMax(at.tail<2>());
  }
  return (high - low) / 2;
}

TEST(Ribbon, GoesAlongAHelixAndIsWide) {
  const DrawnMesh mesh = ribbon_of(helix(14));
  ASSERT_FALSE(mesh.empty());
  double nearest = 1e9, farthest = 0, upward = 0;
  for (const Vertex& vertex : mesh) {
    const Vec3 at = in_eigen(vertex.position_m);
    const double radius = at.head<2>().norm();
    nearest = std::min(nearest, radius);
    farthest = std::max(farthest, radius);
    upward = std::max(upward, at.z() - 13 * 1.5);
  }
  EXPECT_GT(nearest, 1.2);
  EXPECT_LT(farthest, 3.0) << "flat along the axis, not a tube";
  EXPECT_GT(upward, 1.0) << "as wide along the axis";
}

TEST(Ribbon, OfAStrandIsFlatInItsSheetAndEndsInAnArrow) {
  const DrawnMesh mesh = ribbon_of(strand(10));
  const Eigen::Vector2d middle = half_size_at(mesh, 3.3 * 4);
  EXPECT_NEAR(middle.x(), 1.0, 0.1);
  EXPECT_LT(middle.y(), 0.45) << "without the pleats, of 0.9";
  const double before = 3.3 * 8 + 0.5;
  EXPECT_GT(half_size_at(mesh, before).x(), 1.4) << "the arrow";
  EXPECT_LT(half_size_at(mesh, 3.3 * 9 - 0.2).x(), 0.7) << "its tip";
}

TEST(Ribbon, IsATubeElsewhere) {
  docking::Molecule line;
  for (int i = 0; i < 8; ++i) add_atom(line, "CA", "C", {3.8 * i, 0, 0}, i);
  const Eigen::Vector2d middle = half_size_at(ribbon_of(line), 3.8 * 4);
  EXPECT_NEAR(middle.x(), 0.28, 0.02);
  EXPECT_NEAR(middle.y(), 0.28, 0.02);
}

/// Each edge must be used equally often in both directions (no border), and normals must point outwards.
TEST(Ribbon, IsClosedAndHasOutwardNormals) {
  for (const docking::Molecule& molecule : {helix(14), strand(10)}) {
    const DrawnMesh mesh = ribbon_of(molecule);
    std::map<std::pair<std::array<long, 3>, std::array<long, 3>>, int> edges;
    const auto place = [&mesh](std::size_t i) {
      const auto& at = mesh[i].position_m;
      return std::array{std::lround(1e4 * at[0]), std::lround(1e4 * at[1]), std::lround(1e4 * at[2])};
    };
    for (std::size_t i = 0; i < mesh.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k) ++edges[{place(i + k), place(i + (k + 1) % 3)}];
      const auto at = [&](std::size_t k) { return in_eigen(mesh[i + k].position_m); };
      const Vec3 face = (at(1) - at(0)).cross(at(2) - at(0));
      if (face.norm() < 1e-6) continue;
      EXPECT_GT(face.normalized().dot(in_eigen(mesh[i].normal)), 0) << i;
    }
    for (const auto& [edge, count] : edges) {
      if (edge.first == edge.second) continue;
      const auto back = edges.find(std::pair(edge.second, edge.first));
      ASSERT_NE(back, edges.end());
      EXPECT_EQ(back->second, count);
    }
  }
}

TEST(Ribbon, HasItsResiduesColours) {
  const docking::Molecule molecule = helix(6);
  std::vector<Rgba> colors(molecule.size(), kRibbonYellow);
  for (std::size_t atom = 6; atom < colors.size(); ++atom) colors[atom] = kGrey;
  DrawnMesh mesh;
  append_ribbon(mesh, molecule, 1, colors);
  const auto yellow = std::ranges::count(mesh, bytes_of(kRibbonYellow), &Vertex::color);
  const auto grey = std::ranges::count(mesh, bytes_of(kGrey), &Vertex::color);
  EXPECT_EQ(static_cast<std::size_t>(yellow + grey), mesh.size());
  EXPECT_NEAR(static_cast<double>(yellow), static_cast<double>(grey), 0.1 * static_cast<double>(yellow));
}

TEST(Ribbon, LeavesTheRestAsSticks) {
  docking::Molecule molecule = helix(6);
  const std::size_t ribbon = ribbon_of(molecule).size();
  add_atom(molecule, "CA", "CA", {30, 0, 0}, 7, "A", "CA");
  add_atom(molecule, "C1", "C", {40, 0, 0}, 8, "A", "LIG");
  add_atom(molecule, "C2", "C", {41.5, 0, 0}, 8, "A", "LIG");
  docking::Molecule rest;
  rest.positions_angstrom = {{30, 0, 0}, {40, 0, 0}, {41.5, 0, 0}};
  rest.mass_u = {40, 12, 12};
  DrawnMesh sticks;
  append_sticks(sticks, rest, 1, std::vector<Rgba>(3, kRibbonYellow));
  EXPECT_EQ(ribbon_of(molecule).size(), ribbon + sticks.size());
  DrawnMesh nameless;
  append_ribbon(nameless, rest, 1, std::vector<Rgba>(3, kRibbonYellow));
  EXPECT_EQ(nameless.size(), sticks.size());
}

TEST(Ribbon, EndsWhereAChainDoes) {
  const auto reach_at = [](const DrawnMesh& mesh, double x) {
    return std::ranges::any_of(mesh, [x](const Vertex& vertex) { return std::abs(vertex.position_m[0] - x) < 0.5; });
  };
  docking::Molecule gap;
  for (int i = 0; i < 4; ++i) add_atom(gap, "CA", "C", {3.8 * i, 0, 0}, i);
  for (int i = 0; i < 4; ++i) add_atom(gap, "CA", "C", {30 + 3.8 * i, 0, 0}, 9 + i);
  EXPECT_TRUE(reach_at(ribbon_of(gap), 5));
  EXPECT_FALSE(reach_at(ribbon_of(gap), 20)) << "residues are missing";
  docking::Molecule two = gap;
  for (std::size_t i = 4; i < 8; ++i) {
    two.positions_angstrom[i].x() -= 30 - 4 * 3.8;
    two.chains[i] = "B";
  }
  EXPECT_FALSE(reach_at(ribbon_of(two), 3.8 * 3.5)) << "another chain";
}

TEST(Ribbon, OfNucleicAcidsHasARodForEachBase) {
  docking::Molecule molecule;
  for (int i = 0; i < 4; ++i) {
    add_atom(molecule, "C4'", "C", {6.0 * i, 0, 0}, i, "A", "DG");
    add_atom(molecule, "N9", "N", {6.0 * i, 4, 0}, i, "A", "DG");
    add_atom(molecule, "N1", "N", {6.0 * i, 8, 0}, i, "A", "DG");
  }
  double reach = 0;
  for (const Vertex& vertex : ribbon_of(molecule)) reach = std::max(reach, double{vertex.position_m[1]});
  EXPECT_NEAR(reach, 8, 0.1);
  EXPECT_NEAR(half_size_at(ribbon_of(molecule), 3).y(), 0.6, 0.05);
}

/// The ribbon must be finite for coincident atoms, because a hostile server may send any positions and names.
TEST(Ribbon, OfAtomsAtOnePlaceIsFinite) {
  docking::Molecule molecule;
  for (int i = 0; i < 6; ++i) add_atom(molecule, "CA", "C", {1, 2, 3}, i);
  for (int i = 6; i < 12; ++i) add_atom(molecule, "CA", "C", {4.0 * (i % 2), 2, 3}, i);
  for (const Vertex& vertex : ribbon_of(molecule)) {
    EXPECT_TRUE(in_eigen(vertex.position_m).allFinite());
    EXPECT_TRUE(in_eigen(vertex.normal).allFinite());
  }
  EXPECT_TRUE(ribbon_of({}).empty());
}

}  // namespace
}  // namespace tandem::client
