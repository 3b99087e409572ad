// Tests shapes that a scene defines by a few numbers. Equal numbers must give the same shape object while it exists.
#include "proto/world_from_wire.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

namespace tandem::proto {
namespace {

wire::Shape box_of(double x_m, double y_m, double z_m) {
  wire::Shape shape;
  for (const double size_m : {x_m, y_m, z_m}) shape.mutable_box()->add_size_m(size_m);
  return shape;
}

TEST(PrimitiveContact, AlikeAreOneWhileInUse) {
  wire::Shape moved = box_of(0.01, 0.02, 0.03);
  moved.mutable_placement()->mutable_position_m()->Add(1);
  const auto box = primitive_contact(box_of(0.01, 0.02, 0.03));
  EXPECT_EQ(primitive_contact(moved), box) << "where it is does not matter";
  EXPECT_NE(primitive_contact(box_of(0.01, 0.02, 0.031)), box);
  EXPECT_NE(primitive_contact(box_of(0.02, 0.01, 0.03)), box);
  wire::Shape cylinder, capsule, sphere;
  cylinder.mutable_cylinder()->set_radius_m(0.01);
  cylinder.mutable_cylinder()->set_length_m(0.02);
  capsule.mutable_capsule()->set_radius_m(0.01);
  capsule.mutable_capsule()->set_length_m(0.02);
  sphere.mutable_sphere()->set_radius_m(0.01);
  EXPECT_NE(primitive_contact(cylinder), primitive_contact(capsule));
  EXPECT_GT(primitive_contact(sphere)->ball_radius_m, 0);

  std::weak_ptr<const contact::ContactShape> expired;
  {
    const auto other = primitive_contact(box_of(0.04, 0.02, 0.03));
    expired = other;
  }
  EXPECT_TRUE(expired.expired()) << "an unused shape must be destroyed";
  EXPECT_NE(primitive_contact(box_of(0.04, 0.02, 0.03)), nullptr);
}

TEST(PrimitiveContact, NonFiniteInputIsRefusedAndNotStored) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto box = primitive_contact(box_of(0.01, 0.02, 0.03));
  EXPECT_THROW(primitive_contact(box_of(nan, 0.02, 0.03)), std::invalid_argument);
  EXPECT_THROW(primitive_contact(box_of(0.01, -0.02, 0.03)), std::invalid_argument);
  EXPECT_EQ(primitive_contact(box_of(0.01, 0.02, 0.03)), box);
  wire::Shape mesh;
  mesh.mutable_mesh();
  EXPECT_EQ(primitive_contact(mesh), nullptr);
  wire::Shape flat;
  flat.mutable_box()->add_size_m(0.01);
  EXPECT_EQ(primitive_contact(flat), nullptr) << "a box has three sizes";
}

TEST(PrimitiveContact, ManyThreadsMayAsk) {
  const auto box = primitive_contact(box_of(0.01, 0.02, 0.03));
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&box, i] {
      for (int k = 0; k < 50; ++k) {
        EXPECT_EQ(primitive_contact(box_of(0.01, 0.02, 0.03)), box);
        wire::Shape sphere;
        sphere.mutable_sphere()->set_radius_m(0.001 * (1 + (i + k) % 3));
        EXPECT_NE(primitive_contact(sphere), nullptr);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace tandem::proto
