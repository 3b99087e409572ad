// Tests the force between two received soft contacts. It must follow a motion of the tool at once, and change smoothly
// when a new contact arrives.
#include "client/model/soft_follower.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tandem::client {
namespace {

constexpr double kSoftFollowerPeriod_s = 0.001;

/// Returns a soft contact that acts like a spring along z. When the tool is at `height_m`, the spring is compressed by
/// `depth_m`.
SoftContact spring(double stiffness_n_per_m, double depth_m, double height_m) {
  SoftContact contact;
  contact.wrench_W.f = Vec3(0, 0, stiffness_n_per_m * depth_m);
  contact.stiffness(2, 2) = stiffness_n_per_m;
  contact.X_WT0.p.z() = height_m;
  contact.trust_radius_m = 0.01;
  return contact;
}

Pose at_height(double z_m) {
  return {Vec3(0, 0, z_m), Quat::Identity()};
}

TEST(SoftFollower, FeelsTheSpringAtOnceAsTheToolMoves) {
  SoftFollower follower;
  follower.receive(spring(200, 0.003, -0.003), at_height(0.02));
  for (int k = 0; k < 500; ++k) follower.step(at_height(0.02), kSoftFollowerPeriod_s);
  for (const double depth_m : {0.001, 0.003, 0.02}) {
    EXPECT_NEAR(follower.step(at_height(-depth_m), kSoftFollowerPeriod_s).f.z(), 200 * depth_m, 1e-3) << depth_m;
  }
  EXPECT_EQ(follower.step(at_height(0.001), kSoftFollowerPeriod_s).f.z(), 0) << "out of it";
}

TEST(SoftFollower, BlendsFromOneContactToTheNextSmoothly) {
  SoftFollower follower;
  const Pose X_WT = at_height(-0.01);
  follower.receive(spring(100, 0.01, -0.01), X_WT);
  for (int k = 0; k < 1000; ++k) follower.step(X_WT, kSoftFollowerPeriod_s);
  double before_n = follower.step(X_WT, kSoftFollowerPeriod_s).f.z(), rise_before_n = 0;
  ASSERT_NEAR(before_n, 1, 1e-6);
  follower.receive(spring(100, 0.02, -0.01), X_WT);
  for (int k = 0; k < 1000; ++k) {
    const double force_n = follower.step(X_WT, kSoftFollowerPeriod_s).f.z();
    // The force changes by 1 N through a critically damped filter with the time constant τ = 50 ms. Its slope is at
    // most 1 N / (e τ) = 0.0074 N/ms. The slope changes by at most 1 N / τ² = 4.0e-4 N/ms per ms.
    EXPECT_LT(force_n - before_n, 0.0075) << k;
    EXPECT_LT(std::abs(force_n - before_n - rise_before_n), 4.1e-4) << k;
    rise_before_n = force_n - before_n;
    before_n = force_n;
  }
  EXPECT_NEAR(before_n, 2, 1e-6);
}

TEST(SoftFollower, ARepeatedContactChangesNothing) {
  SoftFollower once, often;
  const SoftContact contact = spring(100, 0.01, -0.01);
  once.receive(contact, at_height(0));
  for (int k = 0; k < 100; ++k) {
    const Pose X_WT = at_height(-1e-4 * k);
    often.receive(contact, X_WT);
    EXPECT_EQ(once.step(X_WT, kSoftFollowerPeriod_s).f.z(), often.step(X_WT, kSoftFollowerPeriod_s).f.z()) << k;
  }
}

}  // namespace
}  // namespace tandem::client
