// What a search did not find at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/contact/contact_pair.hpp"
#include "tests/common/contact/hand_made_shell.hpp"

namespace tandem::contact {
namespace {

// A box that moves sideways from beside another until it is 0.3 mm in it, as if it had been there and not been found: where contacts are
// few, that may be.
TEST(ContactPair, WhatWasNotFoundGetsDeeperLittleByLittle) {
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
  EXPECT_NEAR(deepest_of(pair), kDeep_m, 1e-6) << "of the first nothing is known";
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
  EXPECT_NEAR(deepest_of(pair), 2 * kDeep_m, 1e-6) << "what it moved itself counts at once";
}

// A thin wall that something is through would be driven by both of its sides.
TEST(ContactPair, WhatWasNotFoundStopsAtTheRigidDepthAndIsNotLifted) {
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
  EXPECT_NEAR(find(pair, 0.002, 0.02 - 2 * kDeep_m), kRigid_m + kDeep_m, 1e-6) << "its own motion counts at once";
  EXPECT_NEAR(find(pair, 0.002, 0.02 - 2 * kDeep_m), kRigid_m + kDeep_m, 1e-6) << "and stays";
}

}  // namespace
}  // namespace tandem::contact
