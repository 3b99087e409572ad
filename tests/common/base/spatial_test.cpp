#include "common/base/spatial.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "common/base/workspace.hpp"

namespace tandem {
namespace {

Vec3 random_vector(Random& random, double scale) {
  return {random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)};
}
Pose random_pose(Random& random) {
  return {random_vector(random, 1.0), quaternion_of(random_vector(random, 3.0))};
}

TEST(Pose, TimesItsInverseIsIdentity) {
  Random random(5);
  for (int i = 0; i < 1'000; ++i) {
    const Pose X = random_pose(random);
    const Pose identity = X * X.inverse();
    ASSERT_LT(identity.p.norm(), 1e-14);
    ASSERT_LT(rotation_vector(identity.q).norm(), 1e-14);
  }
}

TEST(RotationVector, InvertsQuaternionOfUpToHalfATurn) {
  Random random(6);
  for (int i = 0; i < 10'000; ++i) {
    const double angle =
        i % 2 == 0 ? random.uniform(0, std::numbers::pi - 1e-6) : std::pow(10, random.uniform(-14, -3));
    const Vec3 rotation = random_vector(random, 1).normalized() * angle;
    ASSERT_LT((rotation_vector(quaternion_of(rotation)) - rotation).norm(), 1e-8 * angle + 1e-15) << "angle " << angle;
  }
}

TEST(RotationVector, IsTheSameForBothSignsOfAQuaternion) {
  Random random(7);
  for (int i = 0; i < 1'000; ++i) {
    const Quat q = quaternion_of(random_vector(random, 2));
    ASSERT_LT((rotation_vector(q) - rotation_vector(Quat(-q.coeffs()))).norm(), 1e-14);
  }
}

TEST(Integrate, TurnsAboutTheWorldAxis) {
  const Pose start{Vec3::Zero(), quaternion_of({std::numbers::pi / 2, 0, 0})};
  const Pose end = integrate(start, {{1, 0, 0}, {0, 0, 1}}, 0.5);
  EXPECT_NEAR((end.p - Vec3(0.5, 0, 0)).norm(), 0, 1e-15);
  const Quat expected = quaternion_of({0, 0, 0.5}) * start.q;
  EXPECT_NEAR(end.q.angularDistance(expected), 0, 1e-12);
}

TEST(ClampedToLength, BoundsHugeVectorsWithoutOverflow) {
  const Vec3 clamped = clamped_to_length({1e300, -1e300, 0}, 2.0);
  EXPECT_NEAR(clamped.norm(), 2.0, 1e-12);
  EXPECT_NEAR(clamped.x(), std::sqrt(2.0), 1e-12);
  EXPECT_EQ(clamped_to_length({1e-310, 0, 0}, 1.0).x(), 1e-310);
  EXPECT_EQ(clamped_to_length({std::numeric_limits<double>::infinity(), 0, 0}, 1.0).norm(), 0);
}

TEST(WorkspaceMapping, ScalesHandPowerByOneFactorInAllSixDirections) {
  Random random(8);
  for (int i = 0; i < 1'000; ++i) {
    const WorkspaceMapping mapping{random_pose(random), random.uniform(0.1, 10), random.uniform(0.1, 10)};
    const Twist V_DH{random_vector(random, 1), random_vector(random, 1)};
    const Wrench on_hand_W{random_vector(random, 5), random_vector(random, 1)};
    const Twist V_WH = mapping.world_twist(V_DH);
    const Wrench on_hand_D = mapping.device_wrench(on_hand_W);
    const double world_power = on_hand_W.f.dot(V_WH.v) + on_hand_W.t.dot(V_WH.w);
    const double hand_power = on_hand_D.f.dot(V_DH.v) + on_hand_D.t.dot(V_DH.w);
    ASSERT_NEAR(hand_power, mapping.hand_joules_per_world_joule() * world_power, 1e-10 * (1 + std::abs(hand_power)));
  }
}

TEST(WorkspaceMapping, PutsTheRestingHandleAtTheDeviceBase) {
  Random random(9);
  const WorkspaceMapping mapping{random_pose(random), 2.5, 0.5};
  EXPECT_LT((mapping.world_pose({}).p - mapping.X_WD.p).norm(), 1e-15);
}

}  // namespace
}  // namespace tandem
