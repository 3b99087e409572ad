// A suppressed change must be imperceptible to the hand. Each rule is tested just below and just above its threshold.
#include "common/net/deadband.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tandem::net {
namespace {

constexpr double kStiffness_n_per_m = 300;
constexpr double kStiffness_n_m_per_rad = 0.3;
constexpr Duration kHalfFloor = kDeadbandFloor / 2;

RigidState moving(const Vec3& p, const Vec3& v) {
  RigidState state;
  state.X.p = p;
  state.V.v = v;
  return state;
}

TEST(Deadband, AForceIsNoticedBeyondItsShareOfWhatIsFelt) {
  const Deadband deadband(0.1);
  const Wrench sent{Vec3(0, 0, 4), Vec3::Zero()};
  EXPECT_FALSE(deadband.notices({Vec3(0, 0, 4.39), Vec3::Zero()}, sent));
  EXPECT_TRUE(deadband.notices({Vec3(0, 0, 4.41), Vec3::Zero()}, sent));
  EXPECT_TRUE(deadband.notices({Vec3(0.41, 0, 4), Vec3::Zero()}, sent)) << "also perpendicular to the force";
  EXPECT_FALSE(deadband.notices({Vec3(0.09, 0, 0), Vec3::Zero()}, {})) << "noise at rest";
  EXPECT_TRUE(deadband.notices({Vec3(0.11, 0, 0), Vec3::Zero()}, {}));
  EXPECT_TRUE(deadband.notices({Vec3::Zero(), Vec3(0, 0.0031, 0)}, {}));
}

TEST(Deadband, APlaceIsNoticedAsTheForceThatTheCouplingMakesOfIt) {
  const Deadband deadband(0.1);
  const auto notices = [&](double way_m, double felt_n) {
    return deadband.notices(moving(Vec3(way_m, 0, 0), Vec3::Zero()), {}, {}, {Vec3(0, 0, felt_n), Vec3::Zero()},
                            kStiffness_n_per_m, kStiffness_n_m_per_rad);
  };
  // Smallest noticed change of position: 0.1 of the felt force, divided by the stiffness of 300 N/m. A felt force below
  // 1 N counts as 1 N.
  EXPECT_FALSE(notices(0.99 * 0.1 / 300, 0));
  EXPECT_TRUE(notices(1.01 * 0.1 / 300, 0));
  EXPECT_FALSE(notices(0.99 * 0.6 / 300, 6));
  EXPECT_TRUE(notices(1.01 * 0.6 / 300, 6));
}

TEST(Deadband, SteadyMotionIsNoticedByWhoHoldsTheLastStateOnly) {
  const Deadband deadband(0.1);
  const RigidState sent = moving(Vec3::Zero(), Vec3(0.2, 0, 0));
  const RigidState now = moving(Vec3(0.2 * to_seconds(kHalfFloor), 0, 0), sent.V.v);
  const Pose X_believed = integrate(sent.X, sent.V, to_seconds(kHalfFloor));
  EXPECT_TRUE(deadband.notices(now, sent.V, sent.X, {}, kStiffness_n_per_m, kStiffness_n_m_per_rad));
  EXPECT_FALSE(deadband.notices(now, sent.V, X_believed, {}, kStiffness_n_per_m, kStiffness_n_m_per_rad));
  RigidState faster = now;
  faster.V.v.x() += 0.021;
  EXPECT_TRUE(deadband.notices(faster, sent.V, X_believed, {}, kStiffness_n_per_m, kStiffness_n_m_per_rad));
  RigidState turned = now;
  // A rotation changes the torque by 0.3 N·m per rad, here by 3.3 mN·m. The threshold is 0.1 of the felt torque, which
  // counts as at least 30 mN·m.
  turned.X.q = quaternion_of(Vec3(0, 0, 0.011));
  EXPECT_TRUE(deadband.notices(turned, sent.V, X_believed, {}, kStiffness_n_per_m, kStiffness_n_m_per_rad));
}

TEST(Deadband, SwitchedOffItPassesEverythingAndAValueThatIsNotFiniteAlwaysPasses) {
  EXPECT_TRUE(Deadband(0).notices(Wrench{}, Wrench{}));
  EXPECT_TRUE(Deadband(std::nan("")).is_off());
  const Deadband deadband(0.5);
  EXPECT_TRUE(deadband.notices({Vec3(std::nan(""), 0, 0), Vec3::Zero()}, {}));
  const RigidState lost = moving(Vec3(0, std::numeric_limits<double>::infinity(), 0), Vec3::Zero());
  EXPECT_TRUE(deadband.notices(lost, {}, {}, {}, kStiffness_n_per_m, kStiffness_n_m_per_rad));
}

}  // namespace
}  // namespace tandem::net
