// Tests a standard task of haptic assembly: a peg in a hole with small clearance. Contacts on opposite sides must
// neither jam the peg nor make it vibrate.
#include <gtest/gtest.h>

#include "tests/common/contact/test_meshes.hpp"
#include "tests/common/contact/touch_rig.hpp"

namespace tandem::contact {
namespace {

constexpr double kClearance_m = 1e-4;  // gap on each side of the peg
constexpr double kPeg_m = 0.02;
constexpr double kPegLength_m = 0.06;
constexpr double kMouth_m = 0.04;  // height of the block; the hole extends down to z = 0
constexpr double kWall_m = 0.03;

/// Returns position and size of each wall of the hole.
std::vector<std::pair<Vec3, Vec3>> wall_boxes() {
  const double inner = kPeg_m + 2 * kClearance_m;
  const double outer = inner + 2 * kWall_m;
  const double off = (inner + kWall_m) / 2;
  const double z = kMouth_m / 2;
  return {{{-off, 0, z}, {kWall_m, outer, kMouth_m}},
          {{off, 0, z}, {kWall_m, outer, kMouth_m}},
          {{0, -off, z}, {inner, kWall_m, kMouth_m}},
          {{0, off, z}, {inner, kWall_m, kMouth_m}}};
}

/// One solid block with a square through hole.
geometry::TriangleMesh block_mesh() {
  const double hole_m = kPeg_m + 2 * kClearance_m;
  return block_with_hole_mesh(hole_m, hole_m + 2 * kWall_m, kMouth_m);
}

class Peg {
 public:
  explicit Peg(bool is_mesh) : rig(solver_) {
    rig.shape = make_contact_box({kPeg_m, kPeg_m, kPegLength_m});
    rig.mass_kg = 0.12;
    rig.inertia_B = box_inertia(rig.mass_kg, {kPeg_m, kPeg_m, kPegLength_m});
    rig.friction = 0.2;
    rig.gravity_m_per_s2 = kGravity_m_per_s2;
    rig.law = law_.get();
    rig.coupling_force_n = 6.5;
    rig.X_WB.p.z() = kMouth_m + kPegLength_m / 2 - 0.003;
    rig.X_WH = rig.X_WB;
    rig.add_obstacle(make_contact_box({0.4, 0.4, 0.02}), {{0, 0, -0.01}, Quat::Identity()});
    if (is_mesh) {
      rig.add_obstacle(solid_of(block_mesh()));
      return;
    }
    for (const auto& [p, size] : wall_boxes()) rig.add_obstacle(make_contact_box(size), {p, Quat::Identity()});
  }

  double bottom_m() const { return rig.X_WB.p.z() - kPegLength_m / 2; }
  /// Moves the handle to the height `z_m` at 40 mm/s. Returns the largest upward force on the peg.
  double lead_to(double z_m) {
    double pull_n = 0;
    const double step = 0.04 * kStep_s * (z_m > rig.X_WH.p.z() ? 1 : -1);
    rig.V_WH.v.z() = step / kStep_s;
    while (std::abs(z_m - rig.X_WH.p.z()) > std::abs(step)) {
      rig.X_WH.p.z() += step;
      rig.step();
      EXPECT_TRUE(rig.report.has_converged);
      pull_n = std::max(pull_n, rig.tool_wrench_W.f.z());
      deepest_m = std::max(deepest_m, rig.deepest_m);
    }
    rig.V_WH = {};
    return pull_n;
  }

  double deepest_m = 0;

 private:
  ContactSolver solver_{{1, 1, 8, 40'000, 30}};
  std::unique_ptr<haptics::CouplingLaw> law_ =
      haptics::make_coupling_law("spring-damper", critical_coupling(0.12, 4e-5, 400));

 public:
  TouchRig rig;
};

void expect_goes_in_and_out(bool is_mesh) {
  Peg peg(is_mesh);
  // At the mouth of the hole, the handle is displaced by three times the clearance and rotated by 0.5°.
  peg.rig.X_WH.p += Vec3(3e-4, -3e-4, 0);
  peg.rig.X_WH.q = quaternion_of(Vec3(1, 1, 0.3).normalized() * 0.5 * std::numbers::pi / 180);
  peg.lead_to(kPegLength_m / 2 - 0.005);
  peg.rig.run(0.5);
  EXPECT_NEAR(peg.bottom_m(), 0, 2e-4);
  double fastest = 0;
  Vec3 low = peg.rig.X_WB.p;
  Vec3 high = low;
  for (int i = 0; i < 500; ++i) {
    peg.rig.step();
    fastest = std::max(fastest, peg.rig.speed_m_per_s());
    low = low.cwiseMin(peg.rig.X_WB.p);
    high = high.cwiseMax(peg.rig.X_WB.p);
  }
  EXPECT_LT(fastest, 1e-3);
  EXPECT_LT((high - low).norm(), 2e-5);
  const double weight_n = peg.rig.mass_kg * kGravity_m_per_s2;
  const double pull_n = peg.lead_to(kMouth_m + kPegLength_m / 2 + 0.02);
  EXPECT_LT(pull_n, 5);
  EXPECT_GT(pull_n, weight_n);
  EXPECT_GT(peg.bottom_m(), kMouth_m);
  EXPECT_LT(peg.deepest_m, 2e-4);
}

TEST(Peg, EntersAndLeavesAHoleOfBoxes) {
  expect_goes_in_and_out(false);
}

TEST(Peg, EntersAndLeavesAHoleInAMesh) {
  expect_goes_in_and_out(true);
}

TEST(Peg, FallsIntoTheHoleByItself) {
  Peg peg(false);
  peg.rig.law = nullptr;
  peg.rig.run(0.5);
  EXPECT_NEAR(peg.bottom_m(), 0, 1e-4);
  EXPECT_LT(peg.rig.speed_m_per_s(), 1e-3);
}

}  // namespace
}  // namespace tandem::contact
