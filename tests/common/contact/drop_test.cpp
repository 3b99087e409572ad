// Falling bodies must come to rest, and contacts must not add energy to them.
#include <gtest/gtest.h>

#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

struct Drop {
  ShapePointer shape;
  double mass_kg;
  Eigen::Matrix3d inertia_B;
  Pose X_WB;
};

struct Course {
  double fallen_j = 0;  ///< energy at the start minus energy at the end
  double risen_j = 0;   ///< largest rise of the energy above its previous minimum
  double speed_m_per_s = 0;
  double deepest_m = 0;
};

Course course_of(const Drop& drop, double seconds) {
  ContactSolver solver({});
  TouchRig rig(solver);
  rig.shape = drop.shape;
  rig.mass_kg = drop.mass_kg;
  rig.inertia_B = drop.inertia_B;
  rig.X_WB = drop.X_WB;
  rig.gravity_m_per_s2 = kGravity_m_per_s2;
  rig.add_obstacle(make_contact_box({0.6, 0.6, 0.05}), {{0, 0, -0.025}, Quat::Identity()});
  Course course;
  const double start_j = rig.energy_j();
  double least_j = start_j;
  for (int i = 0; i < static_cast<int>(seconds / kStep_s); ++i) {
    rig.step();
    course.deepest_m = std::max(course.deepest_m, rig.deepest_m);
    const double energy_j = rig.energy_j();
    course.risen_j = std::max(course.risen_j, energy_j - least_j);
    least_j = std::min(least_j, energy_j);
  }
  course.fallen_j = start_j - least_j;
  course.speed_m_per_s = rig.speed_m_per_s();
  return course;
}

// Largest allowed energy gain, relative to the energy lost. The solver uses the contact planes and lever arms at the
// start of a step, so a rotation within the step causes an error of second order.
constexpr double kShareGained = 1e-5;

TEST(Drop, ABoxComesToRestAndNeverGainsEnergy) {
  const Vec3 size_m(0.02, 0.015, 0.01);
  const ShapePointer boxes[] = {make_contact_box(size_m), solid_of(box_mesh(size_m))};
  for (const ShapePointer& box : boxes) {
    for (const Vec3& turn : {Vec3(0, 0, 0), Vec3(0.5, 0.4, 0.2), Vec3(1.2, -0.3, 0.8)}) {
      const Course course = course_of({box, 0.1, box_inertia(0.1, size_m), {{0, 0, 0.03}, quaternion_of(turn)}}, 1.5);
      EXPECT_LT(course.risen_j, kShareGained * course.fallen_j) << turn.transpose();
      EXPECT_LT(course.speed_m_per_s, 1e-4) << turn.transpose();
      EXPECT_GT(course.fallen_j, 0.01) << turn.transpose();
      EXPECT_LT(course.deepest_m, box->rigid_depth_m + 1e-4) << turn.transpose();
    }
  }
}

TEST(Drop, ABallComesToRestAndNeverGainsEnergy) {
  const ShapePointer balls[] = {make_contact_sphere(0.01), solid_of(sphere_mesh(0.01, 6))};
  for (const ShapePointer& ball : balls) {
    const Course course = course_of({ball, 0.1, sphere_inertia(0.1, 0.01), {{0, 0, 0.03}, Quat::Identity()}}, 1.5);
    EXPECT_LT(course.risen_j, kShareGained * course.fallen_j);
    // The ball may continue to roll slowly, because its points deviate from a sphere and coded normals have errors of
    // 0.1°.
    EXPECT_LT(course.speed_m_per_s, 8e-3);
    EXPECT_GT(course.fallen_j, 0.01);
  }
}

}  // namespace
}  // namespace tandem::contact
