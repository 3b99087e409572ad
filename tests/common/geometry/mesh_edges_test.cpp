#include "common/geometry/mesh_edges.hpp"

#include <gmock/gmock.h>

#include <map>
#include <numeric>

namespace tandem::geometry {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

std::vector<std::array<std::uint32_t, 3>> edges_of(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::uint32_t> numbers;
  std::vector<std::array<std::uint32_t, 3>> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto number = [&](int from, int to) {
      return numbers.try_emplace(std::minmax(from, to), static_cast<std::uint32_t>(numbers.size())).first->second;
    };
    edges.push_back({number(a, b), number(b, c), number(c, a)});
  }
  return edges;
}

std::vector<std::vector<int>> regions(const TriangleMesh& mesh, const std::vector<bool>& is_one_of_them) {
  return regions_by_edges(mesh, edges_of(mesh), is_one_of_them);
}

// Returns a strip of four triangles, a strip of two, and a single triangle, which all meet at the edge from vertex 2 to
// 4.
TriangleMesh strips() {
  TriangleMesh mesh;
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}, {4, 3, 5}, {2, 3, 4}, {2, 4, 6}, {6, 4, 8}, {4, 2, 7}};
  return mesh;
}

TEST(RegionsByEdges, AreConnectedByEdgesOfTwoTriangles) {
  EXPECT_THAT(regions(strips(), std::vector<bool>(7, true)),
              ElementsAre(UnorderedElementsAre(0, 1, 2, 3), UnorderedElementsAre(4, 5), ElementsAre(6)));
}

TEST(RegionsByEdges, GoThroughNoTriangleThatIsNotOneOfThem) {
  EXPECT_THAT(regions(strips(), {true, false, true, true, false, true, false}),
              ElementsAre(ElementsAre(0), UnorderedElementsAre(2, 3), ElementsAre(5)));
}

TEST(RegionsByEdges, FaceOneWay) {
  TriangleMesh mesh = strips();
  std::swap(mesh.triangles[1][0], mesh.triangles[1][1]);
  EXPECT_THAT(regions(mesh, {true, true, true, true, false, false, false}),
              ElementsAre(ElementsAre(0), ElementsAre(1), UnorderedElementsAre(2, 3)));
}

TEST(PartOf, HasTheTrianglesAloneWhetherTheyAreFewOrMany) {
  for (const int others : {0, 1000}) {
    TriangleMesh mesh;
    for (int i = 0; i < 8 + others; ++i) mesh.vertices.emplace_back(i, 0, 0);
    mesh.triangles = {{0, 1, 2}, {7, 5, 6}, {5, 7, 3}};
    const std::vector<int> some{1, 2};
    const TriangleMesh part = part_of(mesh, some);
    ASSERT_EQ(part.triangles.size(), 2U);
    EXPECT_EQ(part.vertices.size(), 4U);
    for (std::size_t t = 0; t < 2; ++t) {
      EXPECT_EQ(corners_of(part, t), corners_of(mesh, static_cast<std::size_t>(some[t])));
    }
  }
}

}  // namespace
}  // namespace tandem::geometry
