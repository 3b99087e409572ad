#include "proto/soft_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace tandem::proto {
namespace {

std::vector<Vec3> offsets_of(double largest_m) {
  std::vector<Vec3> offsets;
  for (const Vec3& point : soft_lattice()) offsets.push_back(largest_m * Vec3(point.y(), -point.x(), 2 * point.z()));
  return offsets;
}

TEST(SoftShape, IsDecodedWithinHalfAQuantum) {
  for (const double largest_m : {1e-4, 0.01, 1.0, 100.0}) {
    wire::SoftShape message;
    write_soft_shape(3, offsets_of(largest_m), message);
    EXPECT_EQ(message.soft_body(), 3U);
    EXPECT_LE(message.quantum_m(), std::max(5e-5, largest_m / 32000));
    const auto read = read_soft_shape(message);
    ASSERT_TRUE(read);
    for (std::size_t i = 0; i < kSoftLatticePoints; ++i) {
      EXPECT_LE(((*read)[i] - offsets_of(largest_m)[i]).cwiseAbs().maxCoeff(), 0.501 * message.quantum_m());
    }
  }
}

TEST(SoftShape, IsSmall) {
  wire::SoftShape message;
  write_soft_shape(0, offsets_of(0.01), message);
  EXPECT_LE(message.ByteSizeLong(), 1800U);
}

TEST(SoftShape, AValueThatIsNotFiniteBecomesZero) {
  std::vector<Vec3> offsets = offsets_of(0.01);
  offsets[5].x() = std::numeric_limits<double>::quiet_NaN();
  offsets[6].y() = std::numeric_limits<double>::infinity();
  wire::SoftShape message;
  write_soft_shape(0, offsets, message);
  const auto read = read_soft_shape(message);
  ASSERT_TRUE(read);
  EXPECT_EQ((*read)[5].x(), 0);
  EXPECT_EQ((*read)[6].y(), 0);
  EXPECT_NEAR((*read)[7].z(), offsets[7].z(), 5e-5);
}

TEST(SoftShape, HostileOnesAreRefused) {
  wire::SoftShape sound;
  write_soft_shape(0, offsets_of(0.01), sound);
  for (const double quantum_m : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    wire::SoftShape message = sound;
    message.set_quantum_m(quantum_m);
    EXPECT_FALSE(read_soft_shape(message)) << quantum_m;
  }
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{6}, sound.offsets().size() - 1, sound.offsets().size() + 6}) {
    wire::SoftShape message = sound;
    message.set_offsets(std::string(bytes, 'x'));
    EXPECT_FALSE(read_soft_shape(message)) << bytes;
  }
}

// Each edge must belong to two triangles, once in each direction. The enclosed volume must be that of the box.
TEST(SoftLattice, IsAClosedSurfaceSeenFromOutside) {
  std::map<std::pair<int, int>, int> edges;
  double volume = 0;
  for (const auto& [a, b, c] : soft_lattice_faces()) {
    for (const auto& edge : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) ++edges[edge];
    const auto at = [](int i) { return soft_lattice()[static_cast<std::size_t>(i)]; };
    volume += at(a).cross(at(b)).dot(at(c)) / 6;
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1U);
  }
  EXPECT_NEAR(volume, 1, 1e-9);
}

}  // namespace
}  // namespace tandem::proto
