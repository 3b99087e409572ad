#include "devices/sim/sim_device.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/support/allocation_counter.hpp"

namespace tandem::devices {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kPi = std::numbers::pi;

SimDevice resting_hand(const HandParameters& hand = {}, std::uint64_t seed = 1) {
  return {SimDevice::default_spec(), hand, named_hand_path("rest"), seed};
}

Wrench force_x(double newtons) {
  Wrench command;
  command.f.x() = newtons;
  return command;
}

// Frequency and decay rate of a hand that is released at rest from `start_m` and oscillates. The frequency is found
// from the zero crossings of the position x, the decay rate from its peaks.
struct Ringing {
  double frequency_hz;
  double decay_per_s;
};

Ringing ringing_of(const std::vector<double>& x, double period_s) {
  std::vector<double> crossings;
  std::vector<double> peaks;
  for (std::size_t i = 1; i + 1 < x.size(); ++i) {
    if (x[i - 1] > 0 && x[i] <= 0) crossings.push_back(period_s * (i - x[i] / (x[i] - x[i - 1])));
    if (x[i] > x[i - 1] && x[i] >= x[i + 1] && x[i] > 0) peaks.push_back(x[i]);
  }
  const double periods = static_cast<double>(crossings.size() - 1);
  const double frequency_hz = periods / (crossings.back() - crossings.front());
  const double decay = std::log(peaks.front() / peaks.back()) * frequency_hz / (peaks.size() - 1.0);
  return {frequency_hz, decay};
}

TEST(SimDevice, RingsAtTheClosedFormFrequencyAndDecayInTranslation) {
  HandParameters hand;
  hand.damping_n_s_per_m = 0.6;  // low damping, so that several periods can be counted
  SimDevice device = resting_hand(hand);
  device.read(LocalTime{});
  device.write(LocalTime{}, force_x(2));
  device.read(LocalTime(seconds(10)));
  LocalTime now(seconds(10));
  for (; now < LocalTime(seconds(30)); now += seconds(1)) device.read(now);  // settles at 2 N / 200 N/m
  device.write(now, force_x(0));
  std::vector<double> x;
  for (int i = 0; i < 3000; ++i) {
    now += milliseconds(1);
    x.push_back(device.read(now).X_DH.p.x());
  }
  const Ringing ringing = ringing_of(x, 1e-3);
  const double omega = std::sqrt(200 / 0.3);
  const double decay = 0.6 / (2 * 0.3);
  // Tolerance of the frequency. At the angular frequency ω, leapfrog integration with the sub-step h = 0.1 ms has a
  // relative error of (ωh)²/24. Peaks are found on a grid of 1 ms. Both errors together are below 1e-3.
  EXPECT_NEAR(ringing.frequency_hz, std::sqrt(omega * omega - decay * decay) / (2 * kPi), 1e-3 * omega / (2 * kPi));
  EXPECT_NEAR(ringing.decay_per_s, decay, 5e-3 * decay);
}

TEST(SimDevice, RingsAtTheClosedFormFrequencyAndDecayInRotation) {
  HandParameters hand;
  hand.damping_n_m_s_per_rad = 0.001;
  SimDevice device = resting_hand(hand);
  LocalTime now{};
  device.read(now);
  Wrench command;
  command.t.y() = 0.04;
  device.write(now, command);
  for (; now < LocalTime(seconds(20)); now += seconds(1)) device.read(now);
  device.write(now, {});
  std::vector<double> angle;
  for (int i = 0; i < 1500; ++i) {
    now += milliseconds(1);
    angle.push_back(rotation_vector(device.read(now).X_DH.q).y());
  }
  const Ringing ringing = ringing_of(angle, 1e-3);
  const double omega = std::sqrt(0.8 / 4e-4);
  const double decay = 0.001 / (2 * 4e-4);
  EXPECT_NEAR(ringing.frequency_hz, std::sqrt(omega * omega - decay * decay) / (2 * kPi), 1e-3 * omega / (2 * kPi));
  EXPECT_NEAR(ringing.decay_per_s, decay, 5e-3 * decay);
}

TEST(SimDevice, ComesToRestWithoutOscillationAtAnyDamping) {
  // Mass m and damping B have the extreme values that the command line allows. With the sub-step h of the integration,
  // B h/m is 10, where an explicit integrator would be unstable.
  HandParameters hand;
  hand.mass_kg = 0.01;
  hand.damping_n_s_per_m = 1000;
  hand.stiffness_n_per_m = 0;
  hand.inertia_kg_m2 = 1e-6;
  hand.damping_n_m_s_per_rad = 0.1;
  hand.stiffness_n_m_per_rad = 0;
  SimDevice device = resting_hand(hand);
  LocalTime now{};
  device.read(now);
  Wrench command;
  command = {Vec3(5, 0, 0), Vec3(0, 0, 1e-3)};
  device.write(now, command);
  device.read(now += milliseconds(5));
  EXPECT_NEAR(device.hand_twist().v.x(), 5.0 / 1000, 1e-9) << "f/B";
  EXPECT_NEAR(device.hand_twist().w.z(), 1e-3 / 0.1, 1e-9);
  device.write(now, {});
  for (int i = 1; i <= 3; ++i) {
    device.read(now += microseconds(100));
    EXPECT_NEAR(device.hand_twist().v.x(), 5e-3 * std::exp(-10.0 * i), 1e-9 * std::exp(-10.0 * i));
    EXPECT_NEAR(device.hand_twist().w.z(), 1e-2 * std::exp(-10.0 * i), 1e-9 * std::exp(-10.0 * i));
  }
}

TEST(SimDevice, CreepsBackOneWayWhenItsSpringIsOverdamped) {
  HandParameters hand;
  hand.mass_kg = 0.01;
  hand.damping_n_s_per_m = 1000;
  SimDevice device = resting_hand(hand);
  LocalTime now{};
  device.read(now);
  device.write(now, force_x(2));
  for (int i = 0; i < 30; ++i) device.read(now += seconds(1));
  device.write(now, force_x(0));
  double before_m = device.hand_pose().p.x();
  EXPECT_NEAR(before_m, 0.01 * (1 - std::exp(-6.0)), 1e-6) << "30 s of B/K = 5 s each";
  for (int i = 0; i < 5000; ++i) {
    device.read(now += milliseconds(1));
    const double at_m = device.hand_pose().p.x();
    ASSERT_LT(at_m, before_m) << "after " << i << " ms";
    ASSERT_GT(at_m, 0) << "after " << i << " ms";
    before_m = at_m;
  }
  EXPECT_NEAR(before_m, 0.01 * std::exp(-1.0), 0.01 * std::exp(-6.0)) << "5 s later";
}

TEST(SimDevice, IsDeflectedByForceOverStiffness) {
  SimDevice device = resting_hand();
  LocalTime now{};
  device.read(now);
  Wrench command;
  command = {Vec3(1, -2, 3), Vec3(0, 0, 0.08)};
  device.write(now, command);
  for (int i = 0; i < 5; ++i) device.read(now += seconds(1));
  EXPECT_LT((device.hand_pose().p - Vec3(1, -2, 3) / 200).norm(), 1e-9);
  EXPECT_NEAR(rotation_vector(device.hand_pose().q).z(), 0.08 / 0.8, 1e-9);
  EXPECT_LT(device.hand_twist().v.norm(), 1e-9);
}

TEST(SimDevice, ARelaxedHandYieldsAndKeepsItsDamping) {
  WayPoint rest, relaxed;
  relaxed.at = milliseconds(100);
  relaxed.is_relaxed = true;
  SimDevice device(SimDevice::default_spec(), {}, HandPath({rest, relaxed}), 1);
  device.read(LocalTime{});
  device.write(LocalTime{}, Wrench(Vec3(0.2, 0, 0), Vec3(0, 0, 0.001)));
  for (LocalTime now{}; now <= LocalTime(milliseconds(100)); now += milliseconds(1)) device.read(now);
  LocalTime now(milliseconds(100));
  for (int i = 0; i < 1000; ++i) device.read(now += milliseconds(1));
  // Without a spring, a force F moves the hand at the terminal velocity F/B, with the damping B. A torque τ rotates it
  // at τ/B. The test has waited for 20 and 50 time constants.
  EXPECT_NEAR(device.hand_twist().v.x(), 0.2 / 5.8, 1e-9);
  EXPECT_NEAR(device.hand_twist().w.z(), 0.001 / 0.02, 1e-9);
  const double before_m = device.hand_pose().p.x();
  device.write(now, {});
  for (int i = 0; i < 2000; ++i) device.read(now += milliseconds(1));
  EXPECT_NEAR(device.hand_pose().p.x() - before_m, 0.2 / 5.8 * 0.3 / 5.8, 1e-6) << "runs out within m/B, and stays";
}

TEST(SimDevice, ItsMotionDoesNotDependOnTheReadPeriod) {
  std::vector<Vec3> at_two_seconds;
  for (const Duration period : {Duration(microseconds(250)), Duration(milliseconds(1)), Duration(milliseconds(4))}) {
    SimDevice device(SimDevice::default_spec(), {}, named_hand_path("press-down"), 1);
    device.read(LocalTime{});
    device.write(LocalTime{}, force_x(1.5));
    for (LocalTime now{}; now <= LocalTime(seconds(2)); now += period) device.read(now);
    at_two_seconds.push_back(device.hand_pose().p);
  }
  // The device divides its period into sub-steps. Periods of 1 ms and 4 ms give the same sub-steps, so the results must
  // be equal.
  EXPECT_LT((at_two_seconds[2] - at_two_seconds[1]).norm(), 1e-12);
  // A period of 0.25 ms has three sub-steps of 83 µs instead of 100 µs. A first-order integrator changes the position
  // by at most this difference, 16.7 µs, times the largest velocity, 15/8 · 50 mm / 1.5 s.
  EXPECT_LT((at_two_seconds[0] - at_two_seconds[1]).norm(), 16.7e-6 * 0.0625);
}

TEST(SimDevice, HoldsTheForceBetweenWrites) {
  // Expected position without spring and damper: x = F t² / 2m, for a constant force F on a mass m from rest. The
  // tolerance is the relative error of a first-order integrator with the sub-step h, h/t.
  HandParameters hand;
  hand.stiffness_n_per_m = 0;
  hand.damping_n_s_per_m = 0;
  SimDevice device = resting_hand(hand);
  device.read(LocalTime{});
  device.write(LocalTime{}, force_x(3));
  device.read(LocalTime(milliseconds(50)));
  device.write(LocalTime(milliseconds(100)),
               force_x(0));  // acts only from this time on, although no read precedes it
  EXPECT_NEAR(device.hand_pose().p.x(), 3 * 0.1 * 0.1 / 2 / 0.3, 3 * 0.1 * 1e-4 / 2 / 0.3 * 1.01);
  EXPECT_NEAR(device.hand_twist().v.x(), 3 * 0.1 / 0.3, 1e-9);
}

TEST(SimDevice, FollowsItsPathWhenNothingPushes) {
  SimDevice device(SimDevice::default_spec(), {}, named_hand_path("press-down"), 1);
  double worst_m = 0;
  for (LocalTime now{}; now < LocalTime(seconds(10)); now += milliseconds(1)) {
    device.read(now);
    worst_m = std::max(worst_m, (device.hand_pose().p - device.path().pose_at(device.path_time()).p).norm());
  }
  // The hand lags behind the path by about m·a/K, with its mass m = 0.3 kg and stiffness K = 200 N/m. The acceleration
  // of the path is |a| ≤ 5.78·Δ/T² = 0.13 m/s², with the displacement Δ in the time T. The bound is twice this lag,
  // because the hand may overshoot.
  EXPECT_LT(worst_m, 2 * 0.3 * 0.13 / 200);
  EXPECT_GT(worst_m, 0);
}

TEST(SimDevice, TremorHasTheStatedStrengthAndBand) {
  HandParameters hand;
  hand.tremor_rms_n = 0.2;
  hand.tremor_hz = 9;
  // The device does not report the tremor force. The test computes it from the motion of the hand.
  SimDevice device = resting_hand(hand, 7);
  double force_square_sum = 0;
  std::vector<double> x;
  constexpr int kTicks = 120'000;
  Vec3 last_v = Vec3::Zero();
  for (int i = 0; i < kTicks; ++i) {
    const DeviceSample sample = device.read(LocalTime(milliseconds(i)));
    // Equation of motion of the hand: F = m a + B v + K x, with its mass, damping and stiffness.
    const Vec3 force = 0.3 * (sample.V_DH.v - last_v) / 1e-3 + HandParameters{}.damping_n_s_per_m * sample.V_DH.v +
                       200 * sample.X_DH.p;
    last_v = sample.V_DH.v;
    if (i > 0) force_square_sum += force.squaredNorm();
    x.push_back(force.x());
  }
  // Tolerance: five standard errors of the measured strength, 1.6 % each. They follow for tremor from a filter with the
  // angular frequency ω and the damping ratio ζ:
  // - Its correlation time is 1/(ζω) = 0.18 s.
  // - In 120 s, three components give 3·670 independent values of the square.
  // - The standard error of the mean square is 3 %, and that of its root half as much.
  EXPECT_NEAR(std::sqrt(force_square_sum / kTicks), 0.2, 0.2 * 5 * 0.016);
  double crossings = 0;
  for (std::size_t i = 1; i < x.size(); ++i) crossings += x[i - 1] < 0 && x[i] >= 0;
  EXPECT_NEAR(crossings / 120, 9, 1.0);
}

std::vector<Vec3> trembling(std::uint64_t seed) {
  HandParameters hand;
  hand.tremor_rms_n = 0.2;
  SimDevice device = resting_hand(hand, seed);
  std::vector<Vec3> positions;
  for (int i = 0; i < 500; ++i) positions.push_back(device.read(LocalTime(milliseconds(i))).X_DH.p);
  return positions;
}

TEST(SimDevice, TheSameSeedTremblesTheSameAndAnotherDoesNot) {
  EXPECT_EQ(trembling(3), trembling(3));
  EXPECT_NE(trembling(3), trembling(4));
}

TEST(SimDevice, ReportsWholeEncoderStepsOfTheTruePose) {
  HandParameters hand;
  hand.encoder_step_m = 23e-6;
  hand.encoder_step_rad = 1e-3;
  SimDevice device = resting_hand(hand);
  device.read(LocalTime{});
  Wrench command;
  command = {Vec3(1, 0.5, 0), Vec3(0, 0, 0.05)};
  device.write(LocalTime{}, command);
  for (int i = 1; i < 200; ++i) {
    const DeviceSample sample = device.read(LocalTime(milliseconds(i)));
    const double steps = sample.X_DH.p.x() / 23e-6;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    EXPECT_LE(std::abs(sample.X_DH.p.x() - device.hand_pose().p.x()), 11.5e-6 * (1 + 1e-9));
    const double turns = rotation_vector(sample.X_DH.q).z() / 1e-3;
    EXPECT_NEAR(turns, std::round(turns), 1e-6);
  }
}

TEST(SimDevice, OfAnEncoderReportsTheVelocityOfItsPositionsLateButQuiet) {
  HandParameters hand;
  hand.encoder_step_m = 30e-6;
  hand.encoder_step_rad = 1e-3;
  SimDevice device = resting_hand(hand);
  for (int i = 0; i < 50; ++i) {
    const DeviceSample sample = device.read(LocalTime(milliseconds(i)));
    ASSERT_EQ(sample.V_DH.v.norm(), 0) << "a resting hand must have speed 0";
  }
  Wrench command;
  command = {Vec3(2, 0, 0), Vec3(0, 0, 0.05)};
  device.write(LocalTime(milliseconds(49)), command);
  double worst = 0, worst_turning = 0, fastest = 0;
  for (int i = 50; i < 300; ++i) {
    const DeviceSample sample = device.read(LocalTime(milliseconds(i)));
    EXPECT_NE(sample.V_DH.v, device.hand_twist().v);
    worst = std::max(worst, (sample.V_DH.v - device.hand_twist().v).norm());
    worst_turning = std::max(worst_turning, (sample.V_DH.w - device.hand_twist().w).norm());
    fastest = std::max(fastest, device.hand_twist().v.norm());
  }
  // The velocity estimate must have a smaller error than a difference over one period of 1 ms. Symbols: encoder step s
  // = 30 µm or 1 mrad; acceleration a of at most 2 N / 0.3 kg or 0.05 N·m / 4e-4 kg·m².
  //
  // * A velocity from the difference over one period of 1 ms would jump by s / 1 ms = 30 mm/s or 1 rad/s.
  // * The estimate uses a window of at most √(12 s/a) and lags by half of it. Its error is √(3 s a) = 25 mm/s or 0.6
  //   rad/s.
  // * Within half a period, the velocity changes by another 3 mm/s or 0.06 rad/s.
  EXPECT_GT(fastest, 0.05);
  EXPECT_LT(worst, 0.028);
  EXPECT_LT(worst_turning, 0.66);
}

TEST(SimDevice, GivesTheButtonsOfThePath) {
  SimDevice device(SimDevice::default_spec(), {}, named_hand_path("grab-and-lift"), 1);
  EXPECT_EQ(device.read(LocalTime(seconds(50))).buttons, 0U);  // the path starts at this read
  EXPECT_EQ(device.read(LocalTime(seconds(52))).buttons, 1U);
}

TEST(SimDevice, APathStartsAtTheSetTime) {
  SimDevice device(SimDevice::default_spec(), {}, named_hand_path("press-down"), 1);
  device.begin_path_at(LocalTime::max());
  for (int i = 0; i < 30; ++i) device.read(LocalTime(milliseconds(100) * i));
  EXPECT_EQ(device.hand_pose().p, Vec3::Zero());
  device.begin_path_at(LocalTime(seconds(3)));
  EXPECT_EQ(device.path_time(), Duration(milliseconds(-100))) << "time to its start";
  for (int i = 30; i <= 70; ++i) device.read(LocalTime(milliseconds(100) * i));
  EXPECT_EQ(device.path_time(), Duration(seconds(4)));
  EXPECT_LT((device.hand_pose().p - Vec3(0, 0, -0.05)).norm(), 1e-6);
}

TEST(SimDevice, RefusesAForceThatIsNotFiniteAndKeepsTheLast) {
  SimDevice device = resting_hand();
  device.read(LocalTime{});
  EXPECT_TRUE(device.write(LocalTime{}, force_x(2)));
  EXPECT_FALSE(device.write(LocalTime{}, force_x(std::numeric_limits<double>::infinity())));
  for (int i = 1; i <= 5; ++i) device.read(LocalTime(seconds(i)));
  EXPECT_NEAR(device.hand_pose().p.x(), 0.01, 1e-9);
}

TEST(SimDevice, NeitherReadNorWriteAllocates) {
  HandParameters hand;
  hand.tremor_rms_n = 0.1;
  hand.encoder_step_m = 1e-5;
  hand.encoder_step_rad = 1e-4;
  SimDevice device(SimDevice::default_spec(), hand, named_hand_path("circle"), 1);
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 2000; ++i) {
    device.read(LocalTime(milliseconds(i)));
    device.write(LocalTime(milliseconds(i)), force_x(1));
  }
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(SimDevice, RefusesAHandThatCannotBe) {
  struct Case {
    void (*spoil)(HandParameters&);
    const char* message;
  };
  const Case cases[] = {
      {[](HandParameters& h) { h.mass_kg = 0; }, "simulated hand: mass_kg is 0.000000; it must be above 0"},
      {[](HandParameters& h) { h.damping_n_s_per_m = -1; },
       "simulated hand: damping_n_s_per_m is -1.000000; it must be 0 or more"},
      {[](HandParameters& h) { h.stiffness_n_per_m = 1e9; },
       "simulated hand: stiffness_n_per_m is 1000000000.000000; it must be 0 or more, and sqrt(stiffness / mass) below "
       "3000 rad/s"},
      {[](HandParameters& h) { h.tremor_hz = 0; },
       "simulated hand: tremor_hz is 0.000000; it must be above 0, at most 100"},
  };
  for (const Case& each : cases) {
    HandParameters hand;
    each.spoil(hand);
    try {
      resting_hand(hand);
      ADD_FAILURE() << "accepted: " << each.message;
    } catch (const std::invalid_argument& error) {
      EXPECT_STREQ(error.what(), each.message);
    }
  }
}

}  // namespace
}  // namespace tandem::devices
