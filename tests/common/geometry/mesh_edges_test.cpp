#include "common/geometry/mesh_edges.hpp"

#include <gmock/gmock.h>

namespace tandem::geometry {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

// A strip of triangles 0 to 3 by edges 1 to 3, and another of 4 and 5; at edge 9 there are three.
const std::vector<std::array<std::uint32_t, 3>> kTwoStrips{{10, 11, 1}, {1, 12, 2}, {2, 9, 3}, {3, 13, 14}, {9, 15, 4}, {4, 9, 16}};

TEST(RegionsByEdges, AreWhatHangsTogetherByEdgesOfTwoTriangles) {
  const auto regions = regions_by_edges(kTwoStrips, std::vector<bool>(6, true));
  EXPECT_THAT(regions, ElementsAre(UnorderedElementsAre(0, 1, 2, 3), UnorderedElementsAre(4, 5)));
}

TEST(RegionsByEdges, GoThroughNoTriangleThatIsNotOneOfThem) {
  const auto regions = regions_by_edges(kTwoStrips, {true, false, true, true, true, false});
  EXPECT_THAT(regions, ElementsAre(ElementsAre(0), UnorderedElementsAre(2, 3), ElementsAre(4)));
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
      const auto expected = corners_of(mesh, static_cast<std::size_t>(some[t]));
      EXPECT_EQ(corners_of(part, t), expected);
    }
  }
}

}  // namespace
}  // namespace tandem::geometry
