// Tests stiffnesses from foam to steel, and tools from a needle to a hammer. A pressed tool must be stable, and the
// user must feel the force of the surface.
#include <gtest/gtest.h>

#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

/// A tool that is pressed by a coupling whose handle is 2 mm below the surface.
struct Press {
  const char* name;
  ShapePointer shape;
  double mass_kg;
  double coupling_n_per_m;
  double stiffness_n_per_m3;
};

void expect_calm(const Press& press, const ShapePointer& floor) {
  ContactSolver solver({});
  TouchRig rig(solver);
  rig.shape = press.shape;
  rig.mass_kg = press.mass_kg;
  rig.inertia_B = sphere_inertia(press.mass_kg, 0.005);
  rig.stiffness_n_per_m3 = press.stiffness_n_per_m3;
  rig.add_obstacle(floor, {{0, 0, -0.025}, Quat::Identity()});
  haptics::CouplingParameters c = critical_coupling(press.mass_kg, rig.inertia_B(0, 0), press.coupling_n_per_m);
  c.force_limit_n = 100;
  const auto law = haptics::make_coupling_law("spring-damper", c);
  rig.law = law.get();
  rig.coupling_force_n = 10;
  rig.X_WB.p = {0, 0, 0.006};
  rig.X_WH.p = {0.0005, 0, 0.003};
  rig.run(1);
  const auto what = [&] {
    return std::string(press.name) + " of " + std::to_string(press.mass_kg) + " kg on " +
           std::to_string(press.coupling_n_per_m) + " N/m against " + std::to_string(press.stiffness_n_per_m3);
  };
  EXPECT_TRUE(rig.report.has_converged) << what();
  EXPECT_LT(rig.speed_m_per_s(), 1e-4) << what();
  const double spring_n = press.coupling_n_per_m * (rig.X_WB.p.z() - rig.X_WH.p.z());
  EXPECT_GT(spring_n, 0.1) << what();
  EXPECT_NEAR(rig.contact_force_W.z(), spring_n, 0.01 * spring_n) << what();
  EXPECT_LT(rig.deepest_m, rig.shape->rigid_depth_m + 1e-4) << what();
}

TEST(StiffnessRange, APressedToolIsCalmFromFoamToSteelForEveryMass) {
  const ShapePointer floor = make_contact_box({0.4, 0.4, 0.05});
  const ShapePointer ball = make_contact_sphere(0.005);
  const ShapePointer cube = make_contact_box({0.01, 0.01, 0.01});
  for (const double mass_kg : {0.005, 0.1, 2.0}) {
    for (const double coupling_n_per_m : {300.0, 5000.0}) {
      for (const double stiffness_n_per_m3 : {1e6, 1e8, 1e10, 1e12}) {
        expect_calm({"ball", ball, mass_kg, coupling_n_per_m, stiffness_n_per_m3}, floor);
        expect_calm({"cube", cube, mass_kg, coupling_n_per_m, stiffness_n_per_m3}, floor);
      }
    }
  }
}

}  // namespace
}  // namespace tandem::contact
