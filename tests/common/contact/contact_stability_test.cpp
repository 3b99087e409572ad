// Tests for instabilities that a user would feel: vibration, spontaneous bouncing, energy gain, and passing through a
// surface.
#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "tests/common/contact/touch_scene.hpp"

namespace tandem::contact {
namespace {

constexpr double kMasses_kg[] = {0.005, 0.05, 0.5, 2.0};

TouchScene ball(ContactSolver& solver, double mass_kg, int samples) {
  TouchScene scene(solver);
  scene.mass_kg = mass_kg;
  scene.inertia_B = sphere_inertia(mass_kg, 0.005);
  scene.samples = sphere_samples(0.005, samples);
  scene.planes = {{}};
  return scene;
}

TEST(ContactSolver, AFreeOscillationNeverGainsEnergy) {
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    for (const double k : {100.0, 3000.0, 1e5}) {
      haptics::CouplingParameters c;
      c.stiffness_n_per_m = k;
      c.damping_n_s_per_m = 0;
      c.force_limit_n = 1e6;
      const auto law = haptics::make_coupling_law("spring-damper", c);
      TouchScene scene = ball(solver, mass_kg, 1);
      scene.planes.clear();
      scene.law = law.get();
      scene.X_WB.p = {0.01, -0.02, 0.005};
      const auto energy_j = [&] { return scene.energy_j() + 0.5 * k * scene.X_WB.p.squaredNorm(); };
      for (double before = energy_j(); const int i : {0, 1, 2}) {
        for (int j = 0; j < 300; ++j) {
          scene.step();
          ASSERT_LE(energy_j(), before * (1 + 1e-9) + 1e-18) << mass_kg << " kg " << k << " N/m step " << 300 * i + j;
          before = energy_j();
        }
      }
    }
  }
}

TEST(ContactSolver, APressedToolComesToRestForAnyMassAndStiffness) {
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    for (const double stiffness_n_per_m3 : {1e7, 1e9, 5e9, 1e11}) {
      haptics::CouplingParameters c;
      c.stiffness_n_per_m = 1000;
      c.damping_n_s_per_m = 2 * std::sqrt(1000 * mass_kg);
      c.damping_n_m_s_per_rad = 2 * std::sqrt(0.3 * sphere_inertia(mass_kg, 0.005)(0, 0));
      const auto law = haptics::make_coupling_law("spring-damper", c);
      TouchScene scene = ball(solver, mass_kg, 1000);
      scene.stiffness_n_per_m3 = stiffness_n_per_m3;
      scene.law = law.get();
      scene.X_WB.p.z() = 0.006;
      scene.X_WH.p = {0.001, 0, 0};
      for (int i = 0; i < 1000; ++i) {
        scene.step();
        ASSERT_TRUE(scene.report.has_converged) << mass_kg << " kg " << stiffness_n_per_m3 << " N/m³ step " << i;
      }
      EXPECT_LT(scene.speed_m_per_s(), 1e-5) << mass_kg << " kg " << stiffness_n_per_m3 << " N/m³";
      EXPECT_LT(scene.V_WB.w.norm() * 0.005, 1e-5) << mass_kg << " kg " << stiffness_n_per_m3 << " N/m³";
    }
  }
}

TEST(ContactSolver, AnImpactAtOneMetrePerSecondStaysWithinTheRigidDepth) {
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    for (const int samples : {50, 2000}) {
      for (const double start_m : {0.0053, 0.0056, 0.0059}) {
        TouchScene scene = ball(solver, mass_kg, samples);
        scene.X_WB.p.z() = start_m;
        scene.V_WB.v = {0.3, 0, -1};
        double deepest_m = 0;
        for (int i = 0; i < 30; ++i) {
          scene.step();
          ASSERT_TRUE(scene.report.has_converged);
          deepest_m = std::max(deepest_m, scene.deepest_m());
          ASSERT_LT(scene.V_WB.v.z(), 0.5) << mass_kg << " kg, " << samples << " samples";
        }
        EXPECT_LE(deepest_m, scene.rigid_depth_m + 2e-4) << mass_kg << " kg, " << samples << " samples";
      }
    }
  }
}

TEST(ContactSolver, StopsABodyThatMovesNineMillimetresInOneStep) {
  ContactSolver solver({});
  TouchScene scene = ball(solver, 0.05, 4000);
  scene.band_m = 0.01;
  scene.X_WB.p.z() = 0.014;
  scene.V_WB.v.z() = -10;
  scene.step();
  EXPECT_LE(scene.deepest_m(), scene.rigid_depth_m + 2e-4);
  EXPECT_GT(scene.deepest_m(), 0);
}

TEST(ContactSolver, ABodyThatStartsInsideIsPushedOutSlowly) {
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    for (const double stiffness_n_per_m3 : {1e7, 5e9, 1e11}) {
      TouchScene scene = ball(solver, mass_kg, 1000);
      scene.stiffness_n_per_m3 = stiffness_n_per_m3;
      scene.X_WB.p.z() = 0.002;
      // The solver limits the speed at which it pushes a ball out (ContactRows). The limit is ρ / (h + τ) in the soft
      // layer, with the rigid depth ρ, the step h and the dissipation time τ. Below the layer it is 0.2 m/s. The larger
      // limit must hold.
      const double fastest = std::max(scene.rigid_depth_m / (kStep_s + scene.dissipation_s), 0.2);
      for (int i = 0; i < 200; ++i) {
        scene.step();
        ASSERT_LE(scene.V_WB.v.z(), fastest * (1 + 1e-6)) << mass_kg << " kg " << stiffness_n_per_m3 << " N/m³";
      }
      EXPECT_LT(scene.deepest_m(), scene.rigid_depth_m + 1e-5) << mass_kg << " kg " << stiffness_n_per_m3 << " N/m³";
    }
  }
}

TEST(ContactSolver, AJumpOfTheHandDoesNotPullTheToolThroughAWall) {
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    for (const double limit_n : {6.5, 1000.0}) {
      haptics::CouplingParameters c;
      c.stiffness_n_per_m = 1e5;
      c.force_limit_n = limit_n;
      const auto law = haptics::make_coupling_law("spring-damper", c);
      TouchScene scene = ball(solver, mass_kg, 500);
      // The wall lies between z = −2 mm and z = 0. Each of its two faces acts on points that are at most 1 mm deep. If
      // the ball passed the middle of the wall, the second face would push it out at the back.
      scene.planes = {{Vec3::UnitZ(), 0, 1e-3}, {-Vec3::UnitZ(), 2e-3, 1e-3}};
      scene.law = law.get();
      scene.X_WB.p.z() = 0.0052;
      scene.X_WH.p.z() = 0.0052;
      scene.run(0.05);
      scene.X_WH.p.z() -= 0.05;
      for (int i = 0; i < 500; ++i) {
        scene.step();
        ASSERT_GT(scene.X_WB.p.z(), 0.005 - scene.rigid_depth_m - 2e-4)
            << mass_kg << " kg " << limit_n << " N step " << i;
      }
    }
  }
}

TEST(ContactSolver, ConvergesWhenTheHandJumpsAndTurns) {
  constexpr std::uint64_t kSeed = 43;
  Random random(kSeed);
  const auto anywhere = [&random](double scale) {
    return Vec3(random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale));
  };
  ContactSolver solver({});
  for (const double mass_kg : kMasses_kg) {
    haptics::CouplingParameters c;
    c.stiffness_n_per_m = 1000;
    const auto law = haptics::make_coupling_law("spring-damper", c);
    TouchScene scene = ball(solver, mass_kg, 300);
    scene.law = law.get();
    scene.X_WB.p.z() = 0.006;
    scene.X_BT = {{0.03, 0.01, 0.02}, Quat::Identity()};
    for (int i = 0; i < 1000; ++i) {
      if (i % 50 == 0) scene.X_WH = {anywhere(0.05), quaternion_of(anywhere(1.5))};
      scene.step();
      ASSERT_TRUE(scene.report.has_converged) << "seed " << kSeed << ", " << mass_kg << " kg, step " << i;
    }
  }
}

TEST(ContactSolver, ADroppedBallComesToRestAndNeverGainsEnergy) {
  ContactSolver solver({});
  TouchScene scene = ball(solver, 0.05, 3000);
  scene.gravity_m_per_s2 = kGravity_m_per_s2;
  scene.X_WB.p.z() = 0.015;
  double most_j = 0;
  for (int i = 0; i < 1000; ++i) {
    const double before_j = scene.energy_j();
    scene.step();
    most_j = std::max(most_j, scene.energy_j() - before_j);
  }
  EXPECT_LT(most_j, 1e-9);
  EXPECT_LT(std::abs(scene.V_WB.v.z()), 1e-6);
  EXPECT_LT(scene.speed_m_per_s(), 1e-3);  // slow rolling is allowed, because the points are not exactly on a sphere
}

TEST(ContactSolver, ADroppedTiltedBoxComesToRestOnAFace) {
  ContactSolver solver({});
  const Vec3 size_m(0.02, 0.015, 0.01);
  TouchScene scene(solver);
  scene.inertia_B = box_inertia(scene.mass_kg, size_m);
  scene.samples = box_samples(size_m, 20);
  scene.planes = {{}};
  scene.gravity_m_per_s2 = kGravity_m_per_s2;
  scene.X_WB = {{0, 0, 0.03}, quaternion_of({0.5, 0.4, 0.2})};
  double least_j = scene.energy_j(), risen_j = 0;
  for (int i = 0; i < 2000; ++i) {
    scene.step();
    risen_j = std::max(risen_j, scene.energy_j() - least_j);
    least_j = std::min(least_j, scene.energy_j());
  }
  EXPECT_LT(risen_j, 1e-9);
  EXPECT_LT(scene.speed_m_per_s(), 1e-5);
  EXPECT_LT(scene.V_WB.w.norm(), 1e-3);
  const Vec3 up_B = scene.X_WB.q.conjugate() * Vec3::UnitZ();
  EXPECT_GT(up_B.cwiseAbs().maxCoeff(), std::cos(0.01));
}

}  // namespace
}  // namespace tandem::contact
