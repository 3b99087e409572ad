// Tests both ends of a wave line with a delay between them: energy, tracking of the hand, and contact.
#include "common/haptics/wave/wave_port.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "common/base/spatial.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr CouplingParameters kSlack{.stiffness_n_per_m = 0, .damping_n_s_per_m = 0};

constexpr double kTick_s = 0.001;

/// A hand port, a delay line in each direction, and a tool port with a lower rate. A coupling moves a tool along x.
struct Teleoperator {
  explicit Teleoperator(int delay_ticks, int ticks_per_step = 5) : delay(delay_ticks), every(ticks_per_step) {}

  /// Runs one haptic tick with the hand at `x_hand`. Returns the force on the hand.
  double tick(double x_hand) {
    hand_pose.p.x() = x_hand;
    const Wrench on_hand = hand.tick(hand_pose, kTick_s);
    up.push_back(hand.sum_towards_tool());
    if (k % every == 0) step();
    down.push_back(tool.sum_towards_hand());
    if (k >= delay) {
      const Duration sent = std::chrono::milliseconds(k - delay);
      // The tool sends a message in each of its steps, with the time of the step as time stamp. It arrives `delay`
      // ticks later.
      if ((k - delay) % every == 0) hand.receive(sent, down[static_cast<std::size_t>(k - delay)]);
    }
    ++k;
    return on_hand.f.x();
  }

  void step() {
    const double T = every * kTick_s;
    if (k >= delay) {
      tool.receive(std::chrono::milliseconds(k - delay), up[static_cast<std::size_t>(k - delay)]);
    }
    const double before = target;
    target = tool.move(hand_pose, {stiffness, damping, 0, 0}, T).p.x();
    // The tool is integrated implicitly. It has no mass, but a damper, and a wall beyond x = wall.
    const double v_target = tool.velocity().v.x();
    const double pull = stiffness + damping / T;
    const double push = stiffness * target + damping * (v_target + x_tool / T);
    double x = (push + drag / T * x_tool) / (pull + drag / T);
    if (x > wall) x = (push + drag / T * x_tool + wall_stiffness * wall) / (pull + drag / T + wall_stiffness);
    const double f = stiffness * (target - x) + damping * (v_target - (x - x_tool) / T);
    x_tool = x;
    on_tool = f;
    work_into_tool_j += f * (target - before);
    tool.settle({Vec3(f, 0, 0), Vec3::Zero()}, T);
  }

  int delay, every, k = 0;
  WaveHandPort hand{WaveImpedance{}, WavePlayer::Settings{}};
  WaveToolPort tool{WaveImpedance{}, WavePlayer::Settings{}};
  std::deque<Wave> up, down;
  Pose hand_pose;
  double stiffness = 500, damping = 2, drag = 1, wall = 1e9, wall_stiffness = 5000;
  double x_tool = 0, target = 0, on_tool = 0, work_into_tool_j = 0;
};

TEST(WaveAccount, PaysTheOutgoingWaveInClosedForm) {
  WaveAccount account;
  const Wave two{Vec3(2, 0, 0), Vec3::Zero()}, three{Vec3(3, 0, 0), Vec3::Zero()};
  // Energy of a wave: half of its square times the duration. The arriving wave has ½·4·0.1 = 0.2 J, of which the work
  // has used 0.1 J. The requested wave needs ½·9·0.1 = 0.45 J, but only 0.1 J is left for it.
  const Wave out = account.settle(two, three, 0.1, 0.1);
  EXPECT_NEAR(out.f.x(), 3 * std::sqrt(0.1 / 0.45), 1e-12);
  EXPECT_NEAR(account.balance_j(), 0, 1e-12);
  EXPECT_EQ(squared(account.settle({}, three, 0.5, 0.1)), 0) << "no wave may be sent at a negative balance";
  EXPECT_NEAR(account.balance_j(), -0.5, 1e-12);
}

// A hand moves arbitrarily against line and tool. At the end, it must have supplied more energy than it has extracted.
// Before the end, the extracted energy may exceed the supplied energy by that of one period only.
TEST(WaveLine, ReturnsNoMoreEnergyThanSuppliedAtAnyConstantDelay) {
  for (const int delay : {1, 15, 50, 150}) {
    for (int run = 0; run < 4; ++run) {
      const std::uint64_t seed = test::test_seed(static_cast<std::uint64_t>(run));
      SCOPED_TRACE("delay " + std::to_string(delay) + " ms, seed " + std::to_string(seed));
      Random random(seed);
      Teleoperator line(delay);
      line.wall = run % 2 == 0 ? 0.005 : 1e9;
      double x = 0, v = 0, taken_j = 0, most_j = 0;
      for (int k = 0; k < 8000; ++k) {
        const double f = line.tick(x);
        // The hand follows the force, with noise and within its acceleration limit. It would thus extract any energy
        // that the line creates.
        v += std::clamp(2 * f + random.normal() - 2 * v, -20.0, 20.0) * kTick_s;
        x += v * kTick_s;
        taken_j += f * v * kTick_s;
        most_j = std::max(most_j, taken_j);
      }
      // The hand may gain energy for one period: the force b v of the impedance b is held for a period, while the
      // velocity v changes by 20 m/s² · 1 ms.
      EXPECT_LT(most_j, 1e-5);
      EXPECT_LT(taken_j, 0);
      EXPECT_LE(line.work_into_tool_j, -taken_j + 1e-3) << "nor does the tool's side get more";
    }
  }
}

/// Returns displacement divided by force for a hand that presses against the tool's wall and rests.
double compliance_m_per_n(int delay) {
  Teleoperator line(delay);
  line.wall = 0;
  double f = 0;
  for (int k = 0; k < 12000; ++k) f = line.tick(0.004 * std::min(1.0, k / 1000.0));
  EXPECT_NEAR(f, -line.on_tool, 1e-3) << "the forces at both ends must be opposite";
  return -0.004 / f;
}

// A line at rest acts as a spring in series with the coupling. The waves in transit store the energy ½F² T/b, with the
// force F, the delay T and the impedance b. A spring with the stiffness b/T stores the same energy.
TEST(WaveLine, AtRestInContactIsTheCouplingInSeriesWithTheLinesOwnSpring) {
  const double at_1_ms = compliance_m_per_n(1), at_50_ms = compliance_m_per_n(50);
  const double b = WaveImpedance{}.linear_n_s_per_m;
  EXPECT_NEAR(at_50_ms - at_1_ms, 0.049 / b, 0.02 * 0.049 / b);
  // Both ends together add a further delay: a step of 5 ms at the tool, and a filter of 5 ms. This delay is the rest of
  // the compliance without coupling (500 N/m), wall (5000 N/m) and line (1 ms), times b.
  const double ends_s = (at_1_ms - (1 / 500.0 + 1 / 5000.0)) * b - 0.001;
  EXPECT_GT(ends_s, 0.004);
  EXPECT_LT(ends_s, 0.010);
}

TEST(WaveLine, FreeToolFollowsTheHandWithoutDrift) {
  Teleoperator line(50);
  for (int k = 0; k < 20000; ++k) line.tick(0.05 * std::sin(2 * std::numbers::pi * 0.5 * kTick_s * k));
  for (int k = 0; k < 4000; ++k) line.tick(0.0);
  EXPECT_NEAR(line.x_tool, 0, 2e-4);
}

TEST(WavePorts, AreFiniteForAnyInput) {
  WaveHandPort hand({}, {});
  WaveToolPort tool({}, {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Pose bad;
  bad.p.x() = nan;
  const Wrench huge{Vec3(1e300, 0, 0), Vec3::Zero()};
  EXPECT_TRUE(is_finite(hand.tick(bad, 0.001)));
  EXPECT_TRUE(is_finite(hand.tick({}, nan)));
  hand.tick({}, 0.001);
  hand.set_displayed(huge);
  Pose moved;
  moved.p.x() = 1;
  EXPECT_TRUE(is_finite(hand.tick(moved, 0.001)));
  EXPECT_TRUE(is_finite(hand.sum_towards_tool()));
  EXPECT_TRUE(is_finite(tool.move(bad, kSlack, 0.005)));
  tool.move({}, kSlack, 0.005);
  tool.settle({Vec3(nan, 0, 0), Vec3::Zero()}, 0.005);
  tool.settle(huge, 0.005);
  EXPECT_TRUE(is_finite(tool.move({}, kSlack, 0.005)));
  EXPECT_TRUE(is_finite(tool.sum_towards_hand()));
}

Pose pose_at_x(double x_m) {
  Pose X;
  X.p.x() = x_m;
  return X;
}

TEST(WavePorts, AToolStepWithoutAFinitePoseCountsNeitherWaveNorWorkAgain) {
  const Pose bad = pose_at_x(std::numeric_limits<double>::quiet_NaN());
  const Wrench on_tool_W{Vec3(3, 0, 0), Vec3::Zero()};
  WaveToolPort tool({}, {});
  Wave sum;
  for (int k = 0; k < 20; ++k) {
    tool.receive(std::chrono::milliseconds(5 * k), sum);
    tool.move({}, kSlack, 0.005);
    tool.settle(on_tool_W, 0.005);
    sum = wave_sum(sum, {Vec3(1, 0, 0), Vec3::Zero()}, 0.005);
  }
  const double before_j = tool.balance_j();
  const double resting_x_m = tool.move(bad, kSlack, 0.005).p.x();
  tool.settle(on_tool_W, 0.005);
  // No wave arrives and the handle rests. Only the outgoing wave changes the energy balance, and it takes energy.
  EXPECT_LE(tool.balance_j(), before_j);
  EXPECT_EQ(tool.move(bad, kSlack, 0.005).p.x(), resting_x_m);
  EXPECT_EQ(tool.velocity().v.norm(), 0) << "the coupling damps against the motion of the handle";
  WaveToolPort given({}, {});
  given.move(pose_at_x(0.1), kSlack, 0.005);
  given.settle({}, 0.005);
  for (int k = 0; k < 100; ++k) {
    given.move(bad, kSlack, 0.005);
    given.settle({}, 0.005);
  }
  EXPECT_EQ(given.balance_j(), 0);
}

TEST(WavePorts, AHandTickWithoutAFinitePoseCountsNoWorkOfTheForceThatDidNotAct) {
  const Pose bad = pose_at_x(std::numeric_limits<double>::quiet_NaN());
  WaveHandPort hand({}, {});
  hand.tick(pose_at_x(0), 0.001);
  hand.set_displayed({Vec3(-5, 0, 0), Vec3::Zero()});
  ASSERT_EQ(hand.tick(bad, 0.001).f.norm(), 0);
  const Wrench after = hand.tick(pose_at_x(0.01), 0.001);
  EXPECT_EQ(hand.balance_j(), 0) << "no force acted while the hand moved by 10 mm";
  EXPECT_EQ(after.f.norm(), 0) << "the velocity after a gap is unknown";
}

TEST(WavePorts, AllocateNothing) {
  WaveHandPort hand({}, {});
  WaveToolPort tool({}, {});
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    hand.receive(std::chrono::milliseconds(k), tool.sum_towards_hand());
    hand.tick({}, 0.001);
    tool.receive(std::chrono::milliseconds(k), hand.sum_towards_tool());
    tool.move({}, {500, 2, 0.3, 0.003}, 0.005);
    tool.settle({}, 0.005);
  }
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
