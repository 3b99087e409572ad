// Tests the drawings that windows show: vertex normals, decimation, and their encoding as bytes.
#include "common/geometry/drawing_asset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <stdexcept>

#include "common/base/byte_io.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/geometry/tessellation.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::geometry {
namespace {

/// A ball with about 4 `rings`² triangles.
TriangleMesh ball(int rings) {
  TriangleMesh mesh;
  for (int ring = 0; ring <= rings; ++ring) {
    for (int side = 0; side < 2 * rings; ++side) {
      const double up = M_PI * ring / rings, around = M_PI * side / rings;
      mesh.vertices.emplace_back(0.05 *
                                 Vec3(std::sin(up) * std::cos(around), std::sin(up) * std::sin(around), std::cos(up)));
    }
  }
  for (int ring = 0; ring < rings; ++ring) {
    for (int side = 0; side < 2 * rings; ++side) {
      const int a = 2 * rings * ring + side, b = 2 * rings * ring + (side + 1) % (2 * rings);
      mesh.triangles.push_back({a, a + 2 * rings, b});
      mesh.triangles.push_back({b, a + 2 * rings, b + 2 * rings});
    }
  }
  return mesh;
}

Vec3 normal_of(const TriangleMesh& mesh, const std::array<int, 3>& corners) {
  const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(corners[static_cast<std::size_t>(k)])]; };
  return (at(1) - at(0)).cross(at(2) - at(0)).normalized();
}

TEST(Shading, ABoxHasEdgesAndABallHasNone) {
  const auto [box, box_normals] = shaded(tessellated_box(Vec3(0.03, 0.02, 0.01)));
  EXPECT_EQ(box.vertices.size(), 24U) << "three sides meet in each of its corners";
  for (const auto& triangle : box.triangles) {
    for (const int corner : triangle) {
      EXPECT_LT((box_normals[static_cast<std::size_t>(corner)] - normal_of(box, triangle)).norm(), 1e-12);
    }
  }
  const TriangleMesh round = ball(24);
  const auto [smooth, normals] = shaded(round);
  EXPECT_LE(smooth.vertices.size(), round.vertices.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    EXPECT_GT(normals[i].dot(smooth.vertices[i].normalized()), std::cos(0.1)) << i;
  }
}

TEST(Shading, InvalidTrianglesAreOmittedAndALargeFanIsAccepted) {
  TriangleMesh fan;
  fan.vertices.emplace_back(0, 0, 0);
  constexpr int kSides = 200'000;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * M_PI * i / kSides;
    fan.vertices.emplace_back(std::cos(angle), std::sin(angle), i % 2);
    fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % kSides});
  }
  fan.triangles.push_back({0, 1, 1});
  fan.triangles.push_back({0, 1, kSides + 1});
  fan.triangles.push_back({0, 1, -1});
  EXPECT_EQ(shaded(fan).first.triangles.size(), static_cast<std::size_t>(kSides));
}

TEST(Decimation, KeepsTheShapeWithinACellAndTheLimit) {
  const TriangleMesh fine = ball(100);
  ASSERT_EQ(fine.triangles.size(), 40'000U);
  for (const std::size_t most : {100U, 2000U, 39'999U}) {
    const TriangleMesh few = decimated(fine, most);
    EXPECT_LE(few.triangles.size(), most);
    EXPECT_GE(few.triangles.size(), std::min<std::size_t>(most / 4, 1500));
    // A vertex may be off the sphere by one cell of the decimation grid. The size of a cell follows from two facts:
    // - The ball has a radius of 50 mm and an area of 0.0314 m². With two triangles per cell, a cell has the edge
    //   sqrt(0.0628 / most).
    // - decimated() widens the cells in steps of 15 % until the limit of triangles holds; two steps are allowed.
    const double cell_m = 1.15 * 1.15 * std::sqrt(0.0628 / static_cast<double>(most));
    for (const Vec3& vertex : few.vertices) EXPECT_NEAR(vertex.norm(), 0.05, cell_m) << most;
  }
  const TriangleMesh few = decimated(fine, 2000);
  for (const Vec3& vertex : few.vertices) EXPECT_NEAR(vertex.norm(), 0.05, 1e-3) << "where the faces' planes meet";
  for (const auto& triangle : few.triangles) {
    EXPECT_GT(normal_of(few, triangle).dot(few.vertices[static_cast<std::size_t>(triangle[0])]), 0) << "outside";
  }
  EXPECT_EQ(decimated(fine, 40'000).triangles, fine.triangles);
}

TEST(Decimation, ABoxKeepsItsCorners) {
  TriangleMesh box = tessellated_box(Vec3(0.1, 0.1, 0.1));
  for (int halving = 0; halving < 6; ++halving) {
    TriangleMesh finer{.vertices = box.vertices, .triangles = {}};
    for (const auto& [a, b, c] : box.triangles) {
      const int middle = static_cast<int>(finer.vertices.size());
      const auto at = [&box](int i) { return box.vertices[static_cast<std::size_t>(i)]; };
      for (const auto& [i, j] : {std::pair(a, b), {b, c}, {c, a}}) finer.vertices.emplace_back((at(i) + at(j)) / 2);
      for (const std::array<int, 3>& part : {std::array{a, middle, middle + 2},
                                             {middle, b, middle + 1},
                                             {middle + 2, middle + 1, c},
                                             {middle, middle + 1, middle + 2}}) {
        finer.triangles.push_back(part);
      }
    }
    box = std::move(finer);
  }
  const TriangleMesh few = decimated(box, 1000);
  double farthest = 0;
  for (const Vec3& vertex : few.vertices) farthest = std::max(farthest, vertex.norm());
  EXPECT_NEAR(farthest, 0.05 * std::sqrt(3), 1e-4);
}

TEST(DrawingLevels, GoFromFewTrianglesToAllOfThem) {
  const auto counts = [](const std::vector<ShadedMesh>& levels) {
    std::vector<std::size_t> sizes;
    for (const auto& [mesh, normals] : levels) sizes.push_back(mesh.triangles.size());
    return sizes;
  };
  EXPECT_THAT(counts(drawing_levels(ball(20))), testing::ElementsAre(testing::Le(1600U)));
  const auto sizes = counts(drawing_levels(ball(180)));
  ASSERT_EQ(sizes.size(), 3U);
  EXPECT_THAT(sizes[0], testing::AllOf(testing::Ge(1000U), testing::Le(kDrawingLevels[0])));
  EXPECT_THAT(sizes[1], testing::AllOf(testing::Ge(15'000U), testing::Le(kDrawingLevels[1])));
  EXPECT_THAT(sizes[2], testing::Gt(120'000U));
}

TEST(DrawingAsset, HasErrorsBelowA65000thOfItsSizeAndOneDegree) {
  const ShadedMesh mesh = shaded(ball(30));
  const auto read = drawing_from(drawing_asset_bytes(mesh));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->first.triangles.size(), mesh.first.triangles.size());
  for (std::size_t i = 0; i < mesh.first.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto before = static_cast<std::size_t>(mesh.first.triangles[i][k]);
      const auto after = static_cast<std::size_t>(read->first.triangles[i][k]);
      EXPECT_LT((read->first.vertices[after] - mesh.first.vertices[before]).cwiseAbs().maxCoeff(), 0.1 / 65535);
      EXPECT_GT(read->second[after].dot(mesh.second[before]), std::cos(M_PI / 180));
    }
  }
  EXPECT_LT(drawing_asset_bytes(mesh).size(), surface_asset_bytes(mesh.first).size() / 3);
}

TEST(DrawingAsset, NoByteOfItCanChangeUnseen) {
  const std::vector<std::byte> bytes = drawing_asset_bytes(shaded(tessellated_box(Vec3(0.03, 0.02, 0.01))));
  ASSERT_TRUE(drawing_from(bytes));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte{0x10};
    ASSERT_FALSE(drawing_from(damaged)) << "byte " << i;
    ASSERT_FALSE(drawing_from(std::span(bytes).first(i))) << "cut at " << i;
  }
}

/// Hostile bytes with a valid checksum must give either nothing or a mesh whose vertex indices are all valid. An
/// invalid index would crash the window.
TEST(DrawingAsset, OfHostileBytesIsNothingOrAWholeMesh) {
  const std::vector<std::byte> bytes = drawing_asset_bytes(shaded(ball(4)));
  std::mt19937_64 random(test::test_seed(7));
  int read = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    std::vector<std::uint8_t> octets(octets_of(bytes).begin(), octets_of(bytes).end() - 8);
    for (int change = 0; change < 1 + trial % 3; ++change) {
      octets[8 + random() % (octets.size() - 8)] = static_cast<std::uint8_t>(random());
    }
    end_asset(octets);
    const auto mesh = drawing_from(bytes_of(octets));
    if (!mesh) continue;
    ++read;
    ASSERT_EQ(mesh->second.size(), mesh->first.vertices.size());
    for (const Vec3& vertex : mesh->first.vertices) ASSERT_TRUE(is_finite(vertex));
    for (const Vec3& normal : mesh->second) ASSERT_NEAR(normal.norm(), 1, 1e-9);
    for (const auto& triangle : mesh->first.triangles) {
      for (const int corner : triangle) {
        ASSERT_GE(corner, 0);
        ASSERT_LT(static_cast<std::size_t>(corner), mesh->first.vertices.size());
      }
    }
  }
  EXPECT_GT(read, 0) << "some changed positions or normals must be readable";
}

TEST(DrawingAsset, AMeshThatTheFormatCannotHoldIsRefused) {
  const ShadedMesh good = shaded(tessellated_box(Vec3(1, 1, 1)));
  ShadedMesh far = good, bare = good, beside = good;
  far.first.vertices[0].x() = 2 * kMaxSurfaceReach_m;
  bare.second.pop_back();
  beside.first.triangles[0][0] = static_cast<int>(good.first.vertices.size());
  for (const ShadedMesh& bad : {far, bare, beside, ShadedMesh{}}) {
    EXPECT_THROW(drawing_asset_bytes(bad), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tandem::geometry
