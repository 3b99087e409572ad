// Tests surfaces of molecules without a window: their position, their colours, and that they are closed.
#include "client/view/molecular_surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

using Place = std::array<float, 3>;

constexpr Rgba kYellow{1, 1, 0, 1};
constexpr double kCarbonRadius = 1.70;

Vec3 in_space(const Place& a) {
  return {a[0], a[1], a[2]};
}

docking::Molecule carbons(const std::vector<Vec3>& at) {
  docking::Molecule molecule;
  molecule.positions_angstrom = at;
  molecule.mass_u.assign(at.size(), 12.011);
  return molecule;
}

/// Returns the surface with coordinates in Å.
DrawnMesh surface_of(const docking::Molecule& molecule, std::size_t max_triangles = kMaxSurfaceTriangles) {
  DrawnMesh out;
  append_surface(out, molecule, 1, atom_colors(molecule, MoleculeStyle::kByElement, kYellow), max_triangles);
  return out;
}

/// A copy of a mesh in which vertices at the same position are merged, for tests of its topology.
struct Welded {
  explicit Welded(const DrawnMesh& mesh) {
    std::map<Place, int> found;
    for (const Vertex& vertex : mesh) {
      corners.push_back(found.try_emplace(vertex.position_m, static_cast<int>(found.size())).first->second);
    }
    vertices = static_cast<int>(found.size());
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k) ++edges[{corners[i + k], corners[i + (k + 1) % 3]}];
    }
  }

  /// Returns true if each edge is used equally often in both directions, so that the mesh has no border.
  bool is_closed() const {
    return std::ranges::all_of(edges, [this](const auto& edge) {
      const auto back = edges.find({edge.first.second, edge.first.first});
      return back != edges.end() && back->second == edge.second;
    });
  }
  /// Returns true if the mesh is closed and each edge belongs to exactly two triangles.
  bool is_manifold() const {
    return is_closed() && std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 1; });
  }
  int euler_characteristic() const {
    return vertices - static_cast<int>(edges.size() / 2) + static_cast<int>(corners.size() / 3);
  }
  int components() const {
    std::vector<int> of(static_cast<std::size_t>(vertices));
    std::iota(of.begin(), of.end(), 0);
    const auto root = [&of](int vertex) {
      while (of[static_cast<std::size_t>(vertex)] != vertex) vertex = of[static_cast<std::size_t>(vertex)];
      return vertex;
    };
    for (const auto& [edge, count] : edges) of[static_cast<std::size_t>(root(edge.first))] = root(edge.second);
    int roots = 0;
    for (int vertex = 0; vertex < vertices; ++vertex) roots += of[static_cast<std::size_t>(vertex)] == vertex;
    return roots;
  }

  std::vector<int> corners;
  std::map<std::pair<int, int>, int> edges;  ///< number of triangles for each directed edge (from, to)
  int vertices = 0;
};

double volume_of(const DrawnMesh& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i < mesh.size(); i += 3) {
    const Vec3 a = in_space(mesh[i].position_m), b = in_space(mesh[i + 1].position_m);
    sum += a.dot(b.cross(in_space(mesh[i + 2].position_m))) / 6;
  }
  return sum;
}

/// Returns random hydrogens, carbons and oxygens with the density of a protein, 0.1 atoms per Å³.
docking::Molecule crowd(std::size_t atoms, std::mt19937& random) {
  const double edge = std::cbrt(static_cast<double>(atoms) / 0.1);
  std::uniform_real_distribution<double> anywhere(-edge / 2, edge / 2);
  docking::Molecule molecule;
  constexpr std::array<double, 4> kMasses{1.008, 1.008, 12.011, 15.999};
  for (std::size_t i = 0; i < atoms; ++i) {
    const double x = anywhere(random), y = anywhere(random), z = anywhere(random);
    molecule.positions_angstrom.emplace_back(x, y, z);
    molecule.mass_u.push_back(kMasses[i % kMasses.size()]);
  }
  return molecule;
}

TEST(MolecularSurface, ASingleAtomGivesABallOfItsRadius) {
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(11.13, -7.77, 5.01), Vec3(-90'000.3, 1, 0)}) {
    const DrawnMesh mesh = surface_of(carbons({at}));
    ASSERT_GT(mesh.size(), 3 * 200U);
    const Welded welded(mesh);
    const double rounding = at.norm() * 1e-6;
    for (const Vertex& vertex : mesh) {
      EXPECT_NEAR((in_space(vertex.position_m) - at).norm(), kCarbonRadius, 0.02 + rounding);
    }
    if (rounding > 0.01) continue;
    EXPECT_TRUE(welded.is_manifold());
    EXPECT_EQ(welded.euler_characteristic(), 2);
    EXPECT_EQ(welded.components(), 1);
    const double ball = 4 * std::numbers::pi / 3 * std::pow(kCarbonRadius, 3);
    EXPECT_GT(volume_of(mesh), 0.96 * ball) << "triangles face outwards";
    EXPECT_LT(volume_of(mesh), ball);
  }
}

TEST(MolecularSurface, HasNormalsThatPointOutwards) {
  const Vec3 at(0.3, 0.1, 0.2);
  for (const Vertex& vertex : surface_of(carbons({at}))) {
    const Vec3 outwards = (in_space(vertex.position_m) - at).normalized();
    EXPECT_GT(in_space(vertex.normal).dot(outwards), 0.9999);
  }
  std::mt19937 random(test::test_seed(15));
  const DrawnMesh mesh = surface_of(crowd(200, random));
  std::size_t agreeing = 0;
  for (std::size_t i = 0; i < mesh.size(); i += 3) {
    const Vec3 a = in_space(mesh[i].position_m);
    const Vec3 face = (in_space(mesh[i + 1].position_m) - a).cross(in_space(mesh[i + 2].position_m) - a);
    const Vec3 sum = in_space(mesh[i].normal) + in_space(mesh[i + 1].normal) + in_space(mesh[i + 2].normal);
    if (face.dot(sum) > 0) ++agreeing;
  }
  EXPECT_GT(static_cast<double>(agreeing), 0.99 * static_cast<double>(mesh.size() / 3)) << "of triangles that count";
}

TEST(MolecularSurface, BondedAtomsHaveOneSurfaceAndDistantAtomsTwo) {
  const Welded apart(surface_of(carbons({{0, 0, 0}, {6, 0, 0}})));
  EXPECT_EQ(apart.components(), 2);
  EXPECT_EQ(apart.euler_characteristic(), 4);
  EXPECT_TRUE(apart.is_manifold());
  const Welded bonded(surface_of(carbons({{0, 0, 0}, {1.54, 0, 0}})));
  EXPECT_EQ(bonded.components(), 1);
  EXPECT_EQ(bonded.euler_characteristic(), 2);
  EXPECT_TRUE(bonded.is_manifold());
}

TEST(MolecularSurface, IsOutsideOfAllAtomsAndNearThem) {
  std::mt19937 random(test::test_seed(15));
  const docking::Molecule molecule = crowd(150, random);
  for (const Vertex& vertex : surface_of(molecule)) {
    double nearest = 1e9;
    for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
      const double apart = (in_space(vertex.position_m) - molecule.positions_angstrom[atom]).norm();
      nearest = std::min(nearest, apart - van_der_waals_radius_angstrom(molecule, atom));
    }
    EXPECT_GT(nearest, -0.05);
    EXPECT_LT(nearest, 1.2);
  }
}

TEST(MolecularSurface, HasTheColourOfTheNearestAtom) {
  docking::Molecule molecule = carbons({{0, 0, 0}, {2.4, 0, 0}});
  molecule.mass_u[1] = 32.06;
  std::set<std::array<std::uint8_t, 4>> left, right;
  for (const Vertex& vertex : surface_of(molecule)) {
    const float x = vertex.position_m[0];
    if (x < 0) left.insert(vertex.color);
    if (x > 2.4F) right.insert(vertex.color);
  }
  EXPECT_EQ(left, (std::set{bytes_of(kYellow)})) << "carbon: as the molecule";
  EXPECT_EQ(right, (std::set{bytes_of(atom_colors(molecule, MoleculeStyle::kByElement, kYellow)[1])}));
  EXPECT_NE(*left.begin(), *right.begin());
}

TEST(MolecularSurface, IsNotOfHydrogensAloneOnACoarseGrid) {
  docking::Molecule methanes;
  for (int i = 0; i < 343; ++i) {
    const Vec3 carbon = 3.8 * Vec3(i % 7, i / 7 % 7, i / 49);
    for (const Vec3& way : {Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)}) {
      methanes.positions_angstrom.emplace_back(carbon + 1.09 / std::sqrt(3) * way);
      methanes.mass_u.push_back(way.isZero() ? 12.011 : 1.008);
    }
  }
  const std::size_t fine = surface_of(methanes).size() / 3;
  for (const std::size_t max_triangles : {fine, fine / 10}) {
    const DrawnMesh mesh = surface_of(methanes, max_triangles);
    const auto is_white = [](const Vertex& vertex) { return vertex.color[2] > 118; };
    const auto white = static_cast<double>(std::ranges::count_if(mesh, is_white)) / static_cast<double>(mesh.size());
    EXPECT_LT(white, 0.6) << "carbons are yellow";
    EXPECT_GT(white, 0.02);
  }
}

TEST(MolecularSurface, IsScaledToMetres) {
  DrawnMesh out;
  append_surface(out, carbons({{1, 0, 0}}), 0.01, std::vector<Rgba>{kYellow});
  for (const Vertex& vertex : out) {
    EXPECT_NEAR((in_space(vertex.position_m) - Vec3(0.01, 0, 0)).norm(), 0.01 * kCarbonRadius, 2e-4);
    EXPECT_NEAR(in_space(vertex.normal).norm(), 1, 1e-5);
  }
}

TEST(MolecularSurface, ACrowdOfAtomsHasAClosedSurface) {
  std::mt19937 random(test::test_seed(15));
  for (const std::size_t atoms : {30U, 300U, 3000U}) {
    const Welded welded(surface_of(crowd(atoms, random)));
    EXPECT_GT(welded.vertices, 500);
    EXPECT_TRUE(welded.is_closed()) << atoms << " atoms";
  }
}

TEST(MolecularSurface, StaysWithinTheLimitOfTriangles) {
  std::mt19937 random(test::test_seed(15));
  const docking::Molecule molecule = crowd(2000, random);
  const std::size_t fine = surface_of(molecule).size() / 3;
  for (const std::size_t max_triangles : {fine / 2, fine / 10}) {
    const DrawnMesh mesh = surface_of(molecule, max_triangles);
    EXPECT_LE(mesh.size() / 3, max_triangles);
    EXPECT_GT(mesh.size() / 3, max_triangles / 10) << "coarser, and still there";
    EXPECT_TRUE(Welded(mesh).is_closed());
  }
  // The atoms are so far apart that each has a separate surface. All surfaces together must not exceed the limit of
  // triangles.
  std::vector<Vec3> scattered;
  for (int i = 0; i < 1000; ++i) scattered.emplace_back(1000.0 * (i % 10), 1000.0 * (i / 10 % 10), 1000.0 * (i / 100));
  EXPECT_LE(surface_of(carbons(scattered), 5000).size() / 3, 5000U);
}

TEST(MolecularSurface, OfALargeMoleculeStaysWithinTheBudget) {
  std::mt19937 random(test::test_seed(15));
  const DrawnMesh mesh = surface_of(crowd(20'000, random));
  EXPECT_LE(mesh.size() / 3, kMaxSurfaceTriangles);
  EXPECT_GT(mesh.size() / 3, 10'000U);
}

TEST(MolecularSurface, OfAtomsAtOnePlaceIsClosed) {
  const Welded welded(surface_of(carbons(std::vector<Vec3>(1000, Vec3(0.1, 0.2, 0.3)))));
  EXPECT_TRUE(welded.is_closed());
  EXPECT_EQ(welded.components(), 1);
  EXPECT_TRUE(surface_of({}).empty()) << "no atoms";
}

TEST(MolecularSurface, NothingIsAppendedAfterAStopRequest) {
  std::stop_source stop;
  stop.request_stop();
  DrawnMesh out(3);
  append_surface(out, carbons({{0, 0, 0}}), 1, std::vector<Rgba>{kYellow}, kMaxSurfaceTriangles, stop.get_token());
  EXPECT_EQ(out.size(), 3U);
}

}  // namespace
}  // namespace tandem::client
