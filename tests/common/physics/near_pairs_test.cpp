// A sticking contact must continue to stick when its two bodies change between implicit and external, in any order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "common/physics/touch/touch_stage.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

using Role = TouchThing::Role;
using Roles = std::array<Role, 2>;

/// Two cubes, one on top of the other, pressed together with 1 N. When they rest, tangential forces of 0.3 N pull them
/// in opposite directions; the friction limit is 0.5 N. The stage does not move a cube with the role kExternal.
class PressedCubes {
 public:
  PressedCubes() : stage_({.things = 2, .couplings = 0, .joints = 0, .pairs = 4}) {
    for (std::size_t i = 0; i < 2; ++i) {
      models_.push_back(cube({0, 0, kCubeEdge_m * static_cast<double>(i)}, 10));
      rigids_.emplace_back(models_[i].mass, BodyTraits{}, kCubeEdge_m, models_[i].X_WB);
    }
  }
  void run(const Roles& roles, int steps) {
    for (int k = 0; k < steps; ++k, ++steps_) {
      const double tangential_n = 0.3 * std::clamp((steps_ - 200) / 200.0, 0.0, 1.0);
      std::vector<TouchThing> things(2);
      for (std::size_t i = 0; i < 2; ++i) {
        const double sign = i == 0 ? 1 : -1;
        things[i] = {&rigids_[i], &models_[i].touch, roles[i]};
        // The lines of action pass through the middle of the touching faces, so the cubes do not rotate.
        const Vec3 f = sign * Vec3(tangential_n, 0, 1.0);
        things[i].wrench_W = {f, Vec3(0, 0, sign * kCubeEdge_m / 2).cross(f)};
      }
      EXPECT_EQ(stage_.step(kStep_s, things, {}, {}), 0U);
      for (std::size_t i = 0; i < 2; ++i) {
        if (roles[i] == Role::kExternal) rigids_[i].set_state({rigids_[i].pose(), Twist{}});
      }
    }
  }
  Vec3 between() const { return rigids_[1].pose().p - rigids_[0].pose().p; }

 private:
  std::vector<BodyDescription> models_;
  std::vector<RigidBody> rigids_;
  TouchStage stage_;
  int steps_ = 0;
};

TEST(NearPairs, AContactSticksWhicheverOfItsBodiesBecomesImplicit) {
  constexpr Role kIn = Role::kImplicit, kOut = Role::kExternal;
  const std::array<Roles, 3> all = {Roles{kIn, kIn}, Roles{kIn, kOut}, Roles{kOut, kIn}};
  for (const Roles& before : all) {
    for (const Roles& after : all) {
      SCOPED_TRACE(std::to_string(before[0] == kIn) + std::to_string(before[1] == kIn) + " to " +
                   std::to_string(after[0] == kIn) + std::to_string(after[1] == kIn));
      PressedCubes cubes;
      cubes.run(before, 600);
      const Vec3 stuck = cubes.between();
      const double stretch_m = std::abs(stuck.x());
      ASSERT_LT(stretch_m, 1e-6) << "the contact must stick";
      ASSERT_GT(stretch_m, 1e-8) << "the friction spring is not stretched, so its loss would not be visible";
      cubes.run(after, 50);
      // If the friction state were lost, the contact would yield by the whole stretch of its friction spring.
      EXPECT_LT((cubes.between() - stuck).norm(), 0.25 * stretch_m);
    }
  }
}

}  // namespace
}  // namespace tandem::physics
