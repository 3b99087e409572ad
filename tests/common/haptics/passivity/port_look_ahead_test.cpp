// Tests the bound of the work in the next period, with motions that do as much work as possible.
#include "common/haptics/passivity/port_look_ahead.hpp"

#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "common/base/spatial.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr double kPeriod_s = 1e-3;

Vec3 random_vector(Random& random, double length) {
  return Vec3(random.normal(), random.normal(), random.normal()).normalized() * length;
}

TEST(PortLookAhead, NoMotionWithinTheAccelerationDoesMoreWork) {
  const std::uint64_t seed = test::test_seed(1);
  Random random(seed, 0);
  for (int run = 0; run < 1000; ++run) {
    PortLookAhead port;
    const double step_m = random.uniform(0, 1e-3), turn_rad = random.uniform(0, 1e-2);
    const Vec3 step = random_vector(random, step_m), turn = random_vector(random, turn_rad);
    const Pose first;
    const Pose second{first.p + step, quaternion_of(turn) * first.q};
    port.move_to(first);
    port.move_to(second);
    const Wrench held{random_vector(random, random.uniform(0, 10)), random_vector(random, random.uniform(0, 1))};
    const double faster_m = step_m + PortLookAhead::kMaxAcceleration_m_per_s2 * kPeriod_s * kPeriod_s;
    const double faster_rad = turn_rad + PortLookAhead::kMaxAcceleration_rad_per_s2 * kPeriod_s * kPeriod_s;
    const double bound_j = port.max_work_j(held, kPeriod_s);
    const Pose along{second.p + held.f.normalized() * faster_m,
                     quaternion_of(held.t.normalized() * faster_rad) * second.q};
    EXPECT_NEAR(held_work_j(held, second, along), bound_j, 1e-9 * bound_j) << "it is reached, seed " << seed;
    const Pose anywhere{second.p + random_vector(random, faster_m),
                        quaternion_of(random_vector(random, faster_rad)) * second.q};
    EXPECT_LE(held_work_j(held, second, anywhere), bound_j * (1 + 1e-9)) << "seed " << seed;
  }
}

TEST(PortLookAhead, KnowsNoMotionAtTheFirstPoseNorAfterALostOne) {
  const Wrench held{Vec3(1, 0, 0), Vec3::Zero()};
  const double at_rest_j = PortLookAhead::kMaxAcceleration_m_per_s2 * kPeriod_s * kPeriod_s;
  PortLookAhead port;
  port.move_to({Vec3(1, 0, 0), Quat::Identity()});
  EXPECT_DOUBLE_EQ(port.max_work_j(held, kPeriod_s), at_rest_j);
  port.move_to({Vec3(1.01, 0, 0), Quat::Identity()});
  EXPECT_NEAR(port.max_work_j(held, kPeriod_s), 0.01 + at_rest_j, 1e-12);
  port.lose_pose();
  port.move_to({Vec3(2, 0, 0), Quat::Identity()});
  EXPECT_DOUBLE_EQ(port.max_work_j(held, kPeriod_s), at_rest_j);
}

TEST(PortLookAhead, OfALatePeriodOnlyTheShareIsExpectedAgain) {
  const Wrench held{Vec3(1, 0, 0), Vec3::Zero()};
  PortLookAhead port;
  port.move_to({});
  port.move_to({Vec3(0.01, 0, 0), Quat::Identity()}, 0.1);
  EXPECT_NEAR(port.max_work_j(held, kPeriod_s), 0.001 + 1e-4, 1e-12);
}

TEST(PassivityGain, FallsAtOnceAndRisesFromZeroToOneIn50Ms) {
  EXPECT_EQ(next_passivity_gain(1, 4, 1, kPeriod_s), 0.25);
  double gain = 0;
  for (int k = 0; k < 49; ++k) {
    const double next = next_passivity_gain(gain, 0, 1, kPeriod_s);
    EXPECT_NEAR(next - gain, 0.02, 1e-12);
    gain = next;
  }
  EXPECT_LT(gain, 1);
  EXPECT_EQ(next_passivity_gain(next_passivity_gain(gain, 0, 1, kPeriod_s), 0, 1, kPeriod_s), 1);
}

}  // namespace
}  // namespace tandem::haptics
