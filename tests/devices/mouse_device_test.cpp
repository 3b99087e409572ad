// Tests the hand that a mouse pointer moves. It must follow a jump of the pointer smoothly, yield to forces, and keep
// its limits.
#include "devices/mouse/mouse_device.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/allocation_counter.hpp"

namespace tandem::devices {
namespace {

DeviceSpec six_axes() {
  DeviceSpec spec;
  spec.name = "desk";
  return spec;
}

struct Bench {
  /// Reads the device at 1 kHz for `for_s` seconds. `each` receives every sample.
  void run(double for_s, const std::function<void(const DeviceSample&)>& each = {}) {
    for (const LocalTime end = now + from_seconds(for_s); now < end;) {
      now += std::chrono::milliseconds(1);
      const DeviceSample sample = device.read(now);
      if (each) each(sample);
      last = sample;
    }
  }
  void point_at(const Vec3& p, const Quat& q = Quat::Identity()) { pointer->publish({{p, q}, 0}); }

  std::shared_ptr<Pointer> pointer = std::make_shared<Pointer>();
  MouseDevice device{six_axes(), MouseDevice::default_hand(), pointer};
  LocalTime now{std::chrono::seconds(5)};
  DeviceSample last;
};

TEST(MouseDevice, AJumpOfThePointerBecomesASmoothMovementThatArrives) {
  Bench bench;
  bench.run(0.1);
  bench.point_at({0.1, 0, 0}, quaternion_of({0, 0, 0.5}));
  double overshoot_m = 0, fastest_m_per_s = 0, largest_step_m = 0;
  Vec3 before = bench.last.X_DH.p;
  bench.run(1.5, [&](const DeviceSample& sample) {
    overshoot_m = std::max(overshoot_m, sample.X_DH.p.x() - 0.1);
    fastest_m_per_s = std::max(fastest_m_per_s, sample.V_DH.v.norm());
    largest_step_m = std::max(largest_step_m, (sample.X_DH.p - before).norm());
    before = sample.X_DH.p;
  });
  EXPECT_LT((bench.last.X_DH.p - Vec3(0.1, 0, 0)).norm(), 1e-4);
  EXPECT_LT(rotation_vector(bench.last.X_DH.q).z() - 0.5, 1e-3);
  EXPECT_LT(overshoot_m, 0.01);
  EXPECT_LE(fastest_m_per_s, 1.2 * MouseDevice::kMaxSpeed_m_per_s) << "below the speed that counts as a fault";
  EXPECT_LE(largest_step_m, 1.2 * MouseDevice::kMaxSpeed_m_per_s * 1e-3);
}

TEST(MouseDevice, YieldsToAForceLikeAnArmAndReturns) {
  Bench bench;
  bench.run(0.1);
  ASSERT_TRUE(bench.device.write(bench.now, {Vec3(0, 0, 4), Vec3(0, 0.02, 0)}));
  bench.run(2);
  const HandParameters hand = MouseDevice::default_hand();
  EXPECT_NEAR(bench.last.X_DH.p.z(), 4 / hand.stiffness_n_per_m, 1e-4);
  EXPECT_NEAR(rotation_vector(bench.last.X_DH.q).y(), 0.02 / hand.stiffness_n_m_per_rad, 1e-3);
  ASSERT_TRUE(bench.device.write(bench.now, {}));
  double lowest_m = 0;
  bench.run(2, [&](const DeviceSample& sample) { lowest_m = std::min(lowest_m, sample.X_DH.p.z()); });
  EXPECT_LT(bench.last.X_DH.p.norm(), 1e-4);
  EXPECT_GT(lowest_m, -0.002) << "a damped hand swings little past where it was";
}

TEST(MouseDevice, PressingOnAStiffWallComesToRest) {
  Bench bench;
  bench.run(0.1);
  bench.point_at({0, 0, -0.03});
  const auto wall = [&bench](const DeviceSample& sample) {
    const double deep_m = std::max(0.0, -0.01 - sample.X_DH.p.z());
    bench.device.write(bench.now, {Vec3(0, 0, 1000 * deep_m), Vec3::Zero()});
  };
  bench.run(1, wall);
  double fastest_m_per_s = 0;
  bench.run(1, [&](const DeviceSample& sample) {
    wall(sample);
    fastest_m_per_s = std::max(fastest_m_per_s, sample.V_DH.v.norm());
  });
  EXPECT_LT(fastest_m_per_s, 1e-3) << "the displayed force does not swing";
  EXPECT_NEAR(-bench.last.X_DH.p.z(), 0.01 + 0.02 * 200 / 1200, 5e-4);
}

TEST(MouseDevice, IgnoresATargetThatIsNoPlaceAndGoesNoFartherThanItsReach) {
  Bench bench;
  bench.run(0.01);
  bench.point_at(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  bench.run(0.1);
  EXPECT_TRUE(bench.last.X_DH.p.isZero(0));
  bench.pointer->publish({{Vec3(1, 0, 0), Quat(0, 0, 0, 0)}, kButtonGrab});
  bench.run(0.1);
  EXPECT_EQ(bench.last.buttons, 0U) << "nor its buttons";
  bench.point_at({10, 0, 0});
  bench.run(5);
  EXPECT_NEAR(bench.last.X_DH.p.norm(), MouseDevice::kReach_m, 1e-3);
}

TEST(MouseDevice, ReportsTheButtonsOfThePointer) {
  Bench bench;
  bench.pointer->publish({{}, kButtonGrab | kButtonClutch});
  bench.run(0.002);
  EXPECT_EQ(bench.last.buttons, kButtonGrab | kButtonClutch);
}

TEST(MouseDevice, AllocatesNothingOnATick) {
  Bench bench;
  bench.run(0.01);
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 100; ++i) {
    bench.now += std::chrono::milliseconds(1);
    bench.device.read(bench.now);
    bench.device.write(bench.now, {Vec3(0, 0, 1), Vec3::Zero()});
  }
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

TEST(MouseDevice, ReportsThatItNeedsTheWindow) {
  EXPECT_THROW(MouseDevice(six_axes(), MouseDevice::default_hand(), nullptr), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::devices
