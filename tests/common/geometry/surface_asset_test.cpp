// Surface assets must be read exactly as written. All other bytes must be refused.
#include "common/geometry/surface_asset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "common/base/byte_io.hpp"
#include "common/geometry/tessellation.hpp"

namespace tandem::geometry {
namespace {

constexpr std::size_t kVertexCountAt = 8, kTriangleCountAt = 12, kFirstVertexAt = 16;

TriangleMesh box() {
  return tessellated_box(Vec3(0.03, 0.02, 0.01));
}

/// Returns bytes of the current version with one changed number and a valid checksum, as a hostile server could send
/// them.
template <class T>
std::vector<std::byte> forged(std::vector<std::byte> bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  const auto content = octets_of(std::span(bytes).first(bytes.size() - sizeof(std::uint64_t)));
  std::vector<std::uint8_t> octets(content.begin(), content.end());
  end_asset(octets);
  return bytes_of(octets);
}

TEST(SurfaceAsset, IsReadInSinglePrecision) {
  const TriangleMesh mesh = box();
  const auto read = surface_from(surface_asset_bytes(mesh));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->triangles, mesh.triangles);
  ASSERT_EQ(read->vertices.size(), mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_EQ(read->vertices[i], mesh.vertices[i].cast<float>().cast<double>());
  }
  EXPECT_EQ(surface_asset_bytes(*read), surface_asset_bytes(mesh)) << "writing the read mesh must give the same bytes";
}

TEST(SurfaceAsset, NoByteOfItCanChangeUnseen) {
  const std::vector<std::byte> bytes = surface_asset_bytes(box());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte{0x10};
    ASSERT_FALSE(surface_from(damaged)) << "byte " << i;
    ASSERT_FALSE(surface_from(std::span(bytes).first(i))) << "cut at " << i;
  }
  std::vector<std::byte> longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(surface_from(longer));
}

TEST(SurfaceAsset, CountsThatTheBytesDoNotHoldAreRefusedBeforeMemoryIsTaken) {
  const std::vector<std::byte> bytes = surface_asset_bytes(box());
  ASSERT_TRUE(surface_from(forged(bytes, kVertexCountAt, static_cast<std::uint32_t>(box().vertices.size()))));
  for (const std::uint32_t count : {0U, 1U, 1'000'000U, 1'000'001U, 0xFFFFFFFFU}) {
    EXPECT_FALSE(surface_from(forged(bytes, kVertexCountAt, count))) << count;
    EXPECT_FALSE(surface_from(forged(bytes, kTriangleCountAt, count))) << count;
  }
}

TEST(SurfaceAsset, NumbersThatNoShapeHasAreRefused) {
  const std::vector<std::byte> bytes = surface_asset_bytes(box());
  ASSERT_TRUE(surface_from(forged(bytes, kFirstVertexAt, 999.0F)));
  for (const float coordinate :
       {1001.0F, -1e30F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_FALSE(surface_from(forged(bytes, kFirstVertexAt, coordinate))) << coordinate;
  }
  const std::size_t first_triangle = kFirstVertexAt + box().vertices.size() * 3 * sizeof(float);
  ASSERT_TRUE(surface_from(forged(bytes, first_triangle, std::uint32_t{0})));
  for (const std::uint32_t index : {static_cast<std::uint32_t>(box().vertices.size()), 0x7FFFFFFFU, 0xFFFFFFFFU}) {
    EXPECT_FALSE(surface_from(forged(bytes, first_triangle, index))) << index;
  }
}

TEST(SurfaceAsset, AnInvalidMeshIsRefusedWhenItIsWritten) {
  EXPECT_THROW(surface_asset_bytes({}), std::invalid_argument);
  TriangleMesh far = box();
  far.vertices[0].x() = 1001;
  EXPECT_THROW(surface_asset_bytes(far), std::invalid_argument);
  TriangleMesh beside = box();
  beside.triangles[0][0] = static_cast<int>(beside.vertices.size());
  EXPECT_THROW(surface_asset_bytes(beside), std::invalid_argument);
  TriangleMesh many = box();
  many.triangles.resize(kMaxSurfaceTriangles + 1, many.triangles[0]);
  try {
    surface_asset_bytes(many);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("1000001 triangles"));
  }
}

}  // namespace
}  // namespace tandem::geometry
