// Compares the contact solver with closed forms: resting depths, contact forces and the onset of slip. A wrong
// stiffness, area or friction coefficient in the solver would show here.
#include <gtest/gtest.h>

#include "tests/common/contact/touch_scene.hpp"

namespace tandem::contact {
namespace {

using std::numbers::pi;

haptics::CouplingParameters spring(double stiffness_n_per_m, double damping_n_s_per_m) {
  haptics::CouplingParameters c;
  c.stiffness_n_per_m = stiffness_n_per_m;
  c.damping_n_s_per_m = damping_n_s_per_m;
  c.force_limit_n = 1000;
  return c;
}

TEST(ContactSolver, ACoupledToolSagsByItsWeightOverTheStiffness) {
  ContactSolver solver({});
  for (const double mass_kg : {0.005, 0.05, 0.5, 2.0}) {
    for (const double k : {300.0, 3000.0}) {
      const auto law = haptics::make_coupling_law("spring-damper", spring(k, 2 * std::sqrt(k * mass_kg)));
      TouchScene scene(solver);
      scene.mass_kg = mass_kg;
      scene.inertia_B = sphere_inertia(mass_kg, 0.005);
      scene.gravity_m_per_s2 = kGravity_m_per_s2;
      scene.law = law.get();
      scene.run(3);
      EXPECT_NEAR(scene.X_WB.p.z(), -mass_kg * kGravity_m_per_s2 / k, 1e-9) << mass_kg << " kg " << k << " N/m";
      EXPECT_NEAR(scene.tool_wrench_W.f.z(), mass_kg * kGravity_m_per_s2, 1e-6 * mass_kg * kGravity_m_per_s2);
    }
  }
}

TEST(ContactSolver, ReportsTheCouplingsWrenchAtTheEndOfTheStep) {
  ContactSolver solver({});
  const auto law = haptics::make_coupling_law("spring-damper", haptics::CouplingParameters{});
  TouchScene scene(solver);
  scene.law = law.get();
  scene.X_BT = {{0.02, 0.01, -0.03}, quaternion_of({0.2, -0.4, 0.1})};
  scene.X_WH = {{0.01, -0.005, 0.004}, quaternion_of({0.5, 0.3, -0.2})};
  scene.V_WH = {{0.1, -0.2, 0.05}, {0.5, 1, -1}};
  for (int i = 0; i < 200; ++i) {
    scene.step();
    ASSERT_TRUE(scene.report.has_converged) << "step " << i;
    const Pose X_WT = scene.X_WB * scene.X_BT;
    const Twist V_WT{scene.V_WB.v + scene.V_WB.w.cross(X_WT.p - scene.X_WB.p), scene.V_WB.w};
    const Wrench expected = haptics::coupling_wrenches(*law, scene.X_WH, scene.V_WH, X_WT, V_WT).on_tool_W;
    ASSERT_LT((scene.tool_wrench_W.f - expected.f).norm(), 1e-8);
    ASSERT_LT((scene.tool_wrench_W.t - expected.t).norm(), 1e-10);
  }
}

TEST(ContactSolver, ASphereOnAPlanePressesWithStiffnessTimesPiRadiusDepthSquared) {
  ContactSolver solver({});
  for (const double stiffness_n_per_m3 : {5e9, 5e10}) {
    TouchScene scene(solver);
    scene.samples = sphere_samples(0.005, 20'000);
    scene.planes = {{}};
    scene.stiffness_n_per_m3 = stiffness_n_per_m3;
    scene.X_WB.p.z() = 0.005;
    scene.load_W.f.z() = -5;
    scene.band_m = 1e-3;
    scene.run(0.2);
    const double depth_m = 0.005 - scene.X_WB.p.z();
    ASSERT_LT(depth_m, scene.rigid_depth_m);
    ASSERT_EQ(scene.report.left_out, 0U);
    EXPECT_NEAR(stiffness_n_per_m3 * pi * 0.005 * depth_m * depth_m, 5, 0.02 * 5);
    EXPECT_NEAR(scene.results[0].normal_force_n, 5, 1e-6);
    EXPECT_NEAR(scene.results[0].on_a_W.f.z(), 5, 1e-6);
  }
}

TEST(ContactSolver, ABoxSinksByItsLoadOverStiffnessAndArea) {
  ContactSolver solver({});
  const Vec3 size_m(0.02, 0.01, 0.01);
  for (const double stiffness_n_per_m3 : {1e8, 5e9, 1e11}) {
    TouchScene scene(solver);
    scene.inertia_B = box_inertia(scene.mass_kg, size_m);
    scene.samples = box_samples(size_m, 8);
    scene.planes = {{}};
    scene.stiffness_n_per_m3 = stiffness_n_per_m3;
    scene.dissipation_s = 5e-3;
    scene.X_WB.p.z() = 0.005;
    scene.load_W.f.z() = -3;
    scene.run(1);
    // Pressed area: the bottom face, and the lowest rows of points on the side faces, which are also below the floor.
    double area_m2 = 0;
    for (const SurfaceSample& sample : scene.samples) area_m2 += sample.p_B.z() < -0.004999 ? sample.area_m2 : 0;
    const double expected_m = 3 / (stiffness_n_per_m3 * area_m2);
    ASSERT_LT(expected_m, scene.rigid_depth_m);
    EXPECT_NEAR(scene.deepest_m(), expected_m, 1e-4 * expected_m) << stiffness_n_per_m3;
  }
}

TEST(ContactSolver, ALoadAboveTheSoftLayersLimitRestsAtTheRigidDepth) {
  ContactSolver solver({});
  const Vec3 size_m(0.01, 0.01, 0.01);
  TouchScene scene(solver);
  scene.inertia_B = box_inertia(scene.mass_kg, size_m);
  scene.samples = box_samples(size_m, 8);
  scene.planes = {{}};
  scene.stiffness_n_per_m3 = 1e7;  // so soft that 10 N on 1 cm² would cause a depth of 1 cm without the rigid limit
  scene.X_WB.p.z() = 0.005;
  scene.load_W.f.z() = -10;
  scene.run(0.5);
  EXPECT_GT(scene.deepest_m(), scene.rigid_depth_m);
  EXPECT_LT(scene.deepest_m(), scene.rigid_depth_m + 1e-6);
  EXPECT_LT(scene.speed_m_per_s(), 1e-9);
}

/// A box on a slope that rises along x with the inclination `tilt` [rad].
TouchScene box_on_slope(ContactSolver& solver, double tilt, double friction) {
  const Vec3 size_m(0.02, 0.02, 0.004);
  TouchScene scene(solver);
  scene.inertia_B = box_inertia(scene.mass_kg, size_m);
  scene.samples = box_samples(size_m, 8);
  const Vec3 normal(-std::sin(tilt), 0, std::cos(tilt));
  scene.planes = {{.normal_W = normal}};
  scene.X_WB = {0.002 * normal, quaternion_of({0, -tilt, 0})};
  scene.friction = friction;
  scene.gravity_m_per_s2 = kGravity_m_per_s2;
  return scene;
}

TEST(ContactSolver, ABoxSticksBelowTheFrictionAngleWithoutCreeping) {
  ContactSolver solver({});
  TouchScene scene = box_on_slope(solver, std::atan(0.5) * 0.98, 0.5);
  scene.run(0.5);
  const Vec3 settled = scene.X_WB.p;
  scene.run(2);
  EXPECT_LT((scene.X_WB.p - settled).norm(), 1e-9);
}

TEST(ContactSolver, ABoxSlidesAboveTheFrictionAngle) {
  ContactSolver solver({});
  const double tilt = std::atan(0.5) * 1.02;
  TouchScene scene = box_on_slope(solver, tilt, 0.5);
  scene.run(0.2);
  const double before = scene.speed_m_per_s();
  scene.run(0.5);
  const double expected = kGravity_m_per_s2 * (std::sin(tilt) - 0.5 * std::cos(tilt));
  EXPECT_NEAR((scene.speed_m_per_s() - before) / 0.5, expected, 0.02 * kGravity_m_per_s2 * 0.5);
  EXPECT_GT(scene.speed_m_per_s(), before);
}

TEST(ContactSolver, ASlidingBoxIsSlowedByFrictionTimesGravityAndStops) {
  ContactSolver solver({});
  for (const double friction : {0.1, 0.5, 1.0}) {
    TouchScene scene = box_on_slope(solver, 0, friction);
    scene.run(0.1);
    scene.V_WB.v.x() = 1;
    scene.run(0.01);
    const double before = scene.V_WB.v.x();
    scene.run(0.05);
    EXPECT_NEAR((before - scene.V_WB.v.x()) / 0.05, friction * kGravity_m_per_s2, 0.02 * friction * kGravity_m_per_s2);
    scene.run(1.5);
    EXPECT_LT(scene.speed_m_per_s(), 1e-6);
  }
}

TEST(ContactSolver, APushedBoxHoldsUntilFrictionTimesLoadAndSlipsBeyond) {
  ContactSolver solver({});
  for (const double part : {0.98, 1.02}) {
    TouchScene scene = box_on_slope(solver, 0, 0.5);
    scene.gravity_m_per_s2 = 0;
    // The tangential force acts at the height of the floor. Otherwise the box could tip before it slides.
    scene.load_W = {{part * 0.5 * 4, 0, -4}, Vec3(0, 0, -0.002).cross(Vec3(part * 0.5 * 4, 0, 0))};
    scene.run(0.3);
    const double before = scene.X_WB.p.x();
    scene.run(0.2);
    if (part < 1) {
      EXPECT_LT(std::abs(scene.X_WB.p.x() - before), 1e-9);
    } else {
      EXPECT_GT(scene.X_WB.p.x() - before, 0.5 * (0.04 / scene.mass_kg) * 0.2 * 0.2);
    }
  }
}

}  // namespace
}  // namespace tandem::contact
