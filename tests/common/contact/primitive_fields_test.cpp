#include "common/contact/field/primitive_fields.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/geometry/tessellation.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {
namespace {

constexpr double kRadius = 0.01;
constexpr double kLength = 0.05;
const Vec3 kBox(0.02, 0.03, 0.05);

struct Primitive {
  std::string name;
  std::unique_ptr<DistanceField> field;
  geometry::TriangleMesh outline;
};

std::vector<Primitive> primitives() {
  std::vector<Primitive> all;
  all.push_back({"sphere", sphere_field(kRadius), geometry::tessellated_sphere(kRadius)});
  all.push_back({"box", box_field(kBox), geometry::tessellated_box(kBox)});
  all.push_back({"cylinder", cylinder_field(kRadius, kLength), geometry::tessellated_cylinder(kRadius, kLength)});
  all.push_back({"capsule", capsule_field(kRadius, kLength), geometry::tessellated_capsule(kRadius, kLength)});
  return all;
}

Vec3 random_point(Random& random, double size_m) {
  return {random.uniform(-size_m, size_m), random.uniform(-size_m, size_m), random.uniform(-size_m, size_m)};
}

TEST(PrimitiveFields, AgreeWithTheDistanceToTheirTessellation) {
  // Largest distance of the tessellation from the exact surface with the radius R: R (1 − cos(π/96)) = 5.4e-4 R around
  // the axis, and as much again along an arc.
  const double chord = 2 * kRadius * 5.4e-4;
  for (const Primitive& primitive : primitives()) {
    const geometry::TriangleTree tree(primitive.outline);
    Random random(7);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = random_point(random, 0.04);
      const double distance = tree.signed_distance_m(p);
      ASSERT_NEAR(primitive.field->distance_m(p), distance, chord) << primitive.name << " at " << p.transpose();
    }
  }
}

TEST(PrimitiveFields, HaveTheGradientOfTheirDistance) {
  const double step = 1e-6;
  for (const Primitive& primitive : primitives()) {
    Random random(3);
    int checked = 0;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 p = random_point(random, 0.04);
      const DistanceSample sample = primitive.field->sample(p);
      EXPECT_EQ(sample.distance_m, primitive.field->distance_m(p));
      ASSERT_NEAR(sample.gradient.norm(), 1, 1e-12);
      Vec3 difference;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 offset = step * Vec3::Unit(axis);
        difference[axis] =
            (primitive.field->distance_m(p + offset) - primitive.field->distance_m(p - offset)) / (2 * step);
      }
      // On creases inside the shape, two sides are equally near. The length of the difference quotient is below 1
      // there; these points are skipped.
      if (difference.norm() < 1 - 1e-4) continue;
      ++checked;
      // The tolerance is the error of the difference quotient. The second derivative of a distance is at most 1/r and
      // the third at most 1/r², where r is the distance to the axis or edge.
      EXPECT_LT((sample.gradient - difference).norm(), 1e-4) << primitive.name << " at " << p.transpose();
    }
    EXPECT_GT(checked, 4900) << primitive.name;
  }
}

TEST(PrimitiveFields, LeadBackToTheSurface) {
  for (const Primitive& primitive : primitives()) {
    Random random(11);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = random_point(random, 0.06);
      const DistanceSample sample = primitive.field->sample(p);
      const Vec3 foot = p - sample.distance_m * sample.gradient;
      EXPECT_NEAR(primitive.field->distance_m(foot), 0, 1e-15) << primitive.name << " at " << p.transpose();
    }
  }
}

TEST(PrimitiveFields, HaveADirectionWhereTheyHaveNone) {
  for (const Primitive& primitive : primitives()) {
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(0, 0, 0.01), Vec3(0, 0, kLength / 2), Vec3(0, 0, 1)}) {
      const DistanceSample sample = primitive.field->sample(p);
      EXPECT_NEAR(sample.gradient.norm(), 1, 1e-12) << primitive.name << " at " << p.transpose();
      EXPECT_TRUE(std::isfinite(sample.distance_m));
    }
  }
  EXPECT_DOUBLE_EQ(sphere_field(kRadius)->distance_m(Vec3::Zero()), -kRadius);
  EXPECT_DOUBLE_EQ(box_field(kBox)->distance_m(Vec3::Zero()), -kBox.minCoeff() / 2);
  EXPECT_DOUBLE_EQ(cylinder_field(kRadius, kLength)->distance_m(Vec3::Zero()), -kRadius);
  EXPECT_DOUBLE_EQ(capsule_field(kRadius, kLength)->distance_m(Vec3(0, 0, 1)), 1 - kLength / 2 - kRadius);
}

TEST(PrimitiveFields, MeasureToTheNearestEdgeAndCorner) {
  const auto box = box_field(kBox);
  const DistanceSample corner = box->sample(kBox / 2 + Vec3(0.003, 0.004, 0.012));
  EXPECT_NEAR(corner.distance_m, 0.013, 1e-15);
  EXPECT_LT((corner.gradient - Vec3(3, 4, 12) / 13).norm(), 1e-12);
  const auto cylinder = cylinder_field(kRadius, kLength);
  const DistanceSample rim = cylinder->sample(Vec3(0, -kRadius - 0.003, -kLength / 2 - 0.004));
  EXPECT_NEAR(rim.distance_m, 0.005, 1e-15);
  EXPECT_LT((rim.gradient - Vec3(0, -0.6, -0.8)).norm(), 1e-12);
}

}  // namespace
}  // namespace tandem::contact
