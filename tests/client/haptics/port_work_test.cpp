// Tests the sums of work at the hand's port. Work on the hand and work by the hand must be summed separately.
#include "client/haptics/port_work.hpp"

#include <gtest/gtest.h>

namespace tandem::client {
namespace {

Pose at_x(double x) {
  return {Vec3(x, 0, 0), Quat::Identity()};
}

TEST(PortWork, KeepsBothDirectionsApart) {
  PortWork work;
  work.move_to(at_x(0));
  work.hold({Vec3(2, 0, 0), Vec3::Zero()});
  work.move_to(at_x(0.01));
  work.move_to(at_x(0.005));
  EXPECT_NEAR(work.to_hand_j(), 2 * 0.01, 1e-15);
  EXPECT_NEAR(work.from_hand_j(), 2 * 0.005, 1e-15);
}

TEST(PortWork, CountsRotation) {
  PortWork work;
  work.move_to({});
  work.hold({Vec3::Zero(), Vec3(0, 0, 0.1)});
  work.move_to({Vec3::Zero(), quaternion_of(Vec3(0, 0, 0.3))});
  EXPECT_NEAR(work.to_hand_j(), 0.1 * 0.3, 1e-12);
}

TEST(PortWork, CountsNothingBeforeTheFirstPoseNorAlongALostStretch) {
  PortWork work;
  work.hold({Vec3(5, 0, 0), Vec3::Zero()});
  work.move_to(at_x(1));
  work.lose_pose();
  work.move_to(at_x(2));
  EXPECT_EQ(work.to_hand_j(), 0);
  work.move_to(at_x(1.9));
  EXPECT_NEAR(work.from_hand_j(), 5 * 0.1, 1e-12) << "the wrench was held on";
}

}  // namespace
}  // namespace tandem::client
