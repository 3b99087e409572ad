// Tests contacts that are found late: points that were in contact before, but that earlier searches had missed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "tests/common/contact/hand_made_shell.hpp"

namespace tandem::contact {
namespace {

// In one step, a box is moved sideways into another box until they overlap by 0.3 mm. Earlier searches have not seen
// this overlap, as if their budget had been too small. Fails if it counts at its full depth: the boxes would be thrown
// apart.
TEST(ContactPair, ALateFoundContactGetsDeeperGradually) {
  const ContactShape box = without_flat_parts(box_shape(Vec3::Constant(0.02)));
  const auto at = [](double x_m, double z_m) { return Pose{Vec3(x_m, 0, z_m), Quat::Identity()}; };
  const auto deepest_of = [](const ContactPair& pair) {
    double deepest_m = 0;
    for (const ContactPoint& contact : pair.contacts()) deepest_m = std::max(deepest_m, contact.depth_m);
    return deepest_m;
  };
  constexpr double kDeep_m = 3e-4;
  ContactPair pair(8);
  pair.bind(&box, &box);
  EXPECT_TRUE(pair.find(at(0, 0.02 - kDeep_m), Pose{}, 2e-4).is_coarse);
  EXPECT_NEAR(deepest_of(pair), kDeep_m, 1e-6) << "the depth of the first search must not be limited";
  pair.find(at(0.05, 0.02 - kDeep_m), Pose{}, 2e-4);
  EXPECT_EQ(deepest_of(pair), 0);
  double before_m = 0;
  for (int step = 0; step < 60; ++step) {
    pair.find(at(0.002, 0.02 - kDeep_m), Pose{}, 2e-4);
    EXPECT_LE(deepest_of(pair), before_m + 1.1e-5);
    before_m = deepest_of(pair);
  }
  EXPECT_NEAR(before_m, kDeep_m, 1e-6) << "in the end it is as deep as it is";
  pair.find(at(0.002, 0.02 - 2 * kDeep_m), Pose{}, 2e-4);
  EXPECT_NEAR(deepest_of(pair), 2 * kDeep_m, 1e-6) << "depth caused by its own motion must count at once";
}

// Half of a box's face is rough and has more points than the budget, so the search uses larger nodes of the tree. The
// flat half must still be represented as a face. A few single points would give a wrong force.
TEST(ContactPair, AFlatFaceIsAFaceAtACoarseLevelToo) {
  const Vec3 size_m(0.04, 0.02, 0.01);
  std::vector<ShellPoint> points = box_points(size_m, 2e-4);
  for (ShellPoint& point : points) {
    const Vec3 p = point.p_S.cast<double>();
    if (p.x() < 0 && point.normal_S.z() < 0)
      point.p_S.z() += static_cast<float>(5e-5 * std::sin(9e4 * p.x() * p.y() + 7e3 * p.x()));
  }
  const ContactShape tool = hand_made_shape(box_field(size_m), PointShell::make(std::move(points), 2e-4));
  const ContactShape ground = box_shape(Vec3(0.2, 0.2, 0.02), 1e-3);
  ContactPair pair(128);
  pair.bind(&tool, &ground);
  for (int i = 0; i < 100; ++i) {
    constexpr double kDepth_m = 1e-4;
    const Pose X_WA{Vec3(0.001 * std::sin(0.1 * i), 0, 0.015 - kDepth_m), quaternion_of(Vec3(0.01, 0, 0))};
    const bool is_coarse = pair.find(X_WA, {}, 2e-4).is_coarse;
    EXPECT_TRUE(is_coarse) << i;
    double pressed_m3 = 0;
    for (const ContactPoint& contact : pair.contacts()) {
      if ((X_WA.inverse() * contact.p_W).x() > 0) pressed_m3 += contact.area_m2 * std::max(0.0, contact.depth_m);
    }
    EXPECT_NEAR(pressed_m3, size_m.x() / 2 * size_m.y() * kDepth_m, 0.02 * pressed_m3) << i;
  }
}

// A contact that is found only when it is deep must be limited to the rigid depth. Otherwise both faces of a thin wall
// would push a body that overlaps the wall.
TEST(ContactPair, ALateFoundContactStopsAtTheRigidDepthAndIsNotPushedOut) {
  constexpr double kRigid_m = 5e-5, kDeep_m = 3e-4;
  ContactShape box = without_flat_parts(box_shape(Vec3::Constant(0.02)));
  box.rigid_depth_m = kRigid_m;
  const auto find = [&](ContactPair& pair, double x_m, double z_m) {
    pair.find({Vec3(x_m, 0, z_m), Quat::Identity()}, Pose{}, 2e-4);
    double deepest_m = 0;
    for (const ContactPoint& contact : pair.contacts()) deepest_m = std::max(deepest_m, contact.depth_m);
    return deepest_m;
  };
  ContactPair pair(8);
  pair.bind(&box, &box);
  find(pair, 0.05, 0.02 - kDeep_m);
  find(pair, 0.05, 0.02 - kDeep_m);
  for (int step = 0; step < 60; ++step) EXPECT_LE(find(pair, 0.002, 0.02 - kDeep_m), kRigid_m + 1e-9);
  for (int step = 0; step < 60; ++step) {
    constexpr double kTremble_m = 1e-5;
    const double aside_m = step % 2 == 0 ? kTremble_m : 0;
    EXPECT_LE(find(pair, 0.002, 0.02 - kDeep_m - aside_m), kRigid_m + kTremble_m + 1e-9)
        << "oscillation must not accumulate depth";
  }
  EXPECT_NEAR(find(pair, 0.002, 0.02 - 2 * kDeep_m), kRigid_m + kDeep_m, 1e-6) << "its own motion counts at once";
  EXPECT_NEAR(find(pair, 0.002, 0.02 - 2 * kDeep_m), kRigid_m + kDeep_m, 1e-6) << "and stays";
}

}  // namespace
}  // namespace tandem::contact
