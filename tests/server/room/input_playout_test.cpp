// Tests that the played motion is the delayed motion of the hand, despite jitter, bursts of loss and clock drift.
#include "server/room/input_playout.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <vector>

#include "common/base/random.hpp"
#include "common/net/link.hpp"

namespace tandem::server {
namespace {

constexpr double kInputPlayoutStep_s = 1e-3;
/// Motion of the hand: circles of 5 cm radius at 2 Hz, and rotation by ±0.4 rad at 1.5 Hz about a fixed axis.
constexpr double kHandReach_m = 0.05;
constexpr double kRate = 2 * std::numbers::pi * 2;
constexpr double kTurn_rad = 0.4;
constexpr double kTurnRate = 2 * std::numbers::pi * 1.5;
const Vec3 kAxis = Vec3(1, 2, -2) / 3;

RigidState stirring(double t) {
  RigidState state;
  state.X.p = kHandReach_m * Vec3(std::sin(kRate * t), std::cos(kRate * t), 0);
  state.V.v = kHandReach_m * kRate * Vec3(std::cos(kRate * t), -std::sin(kRate * t), 0);
  state.X.q = quaternion_of(kTurn_rad * std::sin(kTurnRate * t) * kAxis);
  state.V.w = kTurn_rad * kTurnRate * std::cos(kTurnRate * t) * kAxis;
  return state;
}

double from_hand_j(std::uint64_t tick) {
  return 0.002 * static_cast<double>(tick);
}

proto::ClientUpdate input_of(std::uint64_t tick, double client_s) {
  proto::ClientUpdate input;
  input.input_tick = Tick{tick};
  input.sent = LocalTime(from_seconds(client_s));
  input.handle_valid = true;
  input.mode = proto::ClientMode::kLocalModel;
  input.handle = stirring(static_cast<double>(tick) * kInputPlayoutStep_s);
  input.energy_from_hand_j = from_hand_j(tick);
  input.energy_to_hand_j = from_hand_j(tick) / 4;
  return input;
}

/// A client whose clock is 1000 s ahead, a simulated link, and a playout that is queried once per step.
struct Line {
  explicit Line(net::LinkParameters parameters, double its_drift = 0)
      : link(std::move(parameters), 1, 1), drift(its_drift) {}

  /// Makes one step. Returns the input that is played in it.
  std::optional<PlayedInput> step() {
    ++steps;
    const LocalTime now{std::chrono::milliseconds(steps)};
    // The client sends midway between two steps of the room. Its clock deviates from the server's by the fraction
    // `drift`.
    const double client_now_s = (static_cast<double>(steps) + 0.5) * kInputPlayoutStep_s * (1 + drift);
    while (static_cast<double>(sent.size() + 1) * kInputPlayoutStep_s <= client_now_s) {
      const std::uint64_t tick = sent.size() + 1;
      sent.push_back(input_of(tick, 1000 + static_cast<double>(tick) * kInputPlayoutStep_s));
      std::array<std::byte, 8> packet{};
      std::memcpy(packet.data(), &tick, sizeof tick);
      link.send(now, packet);
    }
    // Only the newest packet of a step is used, as in the room's mailbox.
    const proto::ClientUpdate* newest = nullptr;
    while (const auto packet = link.receive(now)) {
      std::uint64_t tick = 0;
      std::memcpy(&tick, packet->data(), sizeof tick);
      newest = &sent[tick - 1];
    }
    if (newest != nullptr) {
      if (taken != 0) longest_gap = std::max(longest_gap, newest->input_tick.value - taken);
      taken = newest->input_tick.value;
      playout.receive(*newest, now.time_since_epoch());
    }
    return playout.play(now.time_since_epoch());
  }

  net::SimulatedLink link;
  double drift;
  InputPlayout playout{kInputPlayoutStep_s};
  std::deque<proto::ClientUpdate> sent;
  std::uint64_t steps = 0;
  std::uint64_t taken = 0;        ///< last received tick
  std::uint64_t longest_gap = 0;  ///< largest difference of two consecutively received ticks
};

net::LinkParameters link_of(double delay_s, double jitter_s, double loss) {
  net::LinkParameters parameters;
  parameters.delay = from_seconds(delay_s);
  parameters.jitter = from_seconds(jitter_s);
  parameters.loss = loss;
  return parameters;
}

double difference_m(const RigidState& a, const RigidState& b) {
  return (a.X.p - b.X.p).norm();
}

TEST(InputPlayout, OverAPerfectLinkPlaysEveryTickOnceAndUnchanged) {
  Line line(link_of(0.020, 0, 0));
  for (int i = 0; i < 2000; ++i) line.step();
  Tick before = line.step()->tick;
  for (int i = 0; i < 500; ++i) {
    const PlayedInput played = *line.step();
    EXPECT_EQ(played.tick.value, before.value + 1);
    before = played.tick;
    const RigidState truth = stirring(static_cast<double>(played.tick.value) * kInputPlayoutStep_s);
    EXPECT_EQ(played.handle.X.p, truth.X.p);
    EXPECT_EQ(played.energy_from_hand_j, from_hand_j(played.tick.value));
  }
  // The newest datagram arrived in this step, so a shorter delay would suffice to play it. The playout waits one step
  // more, so that a later input is always available for interpolation.
  EXPECT_LE(to_seconds(line.playout.delay()), 0.0025);
}

TEST(InputPlayout, JitterAndBurstsOfLossChangeThePlayedHandByLessThanTheCubicsBound) {
  Line line(link_of(0.050, 0.010, 0.05));
  for (int i = 0; i < 3000; ++i) line.step();
  int underruns = 0;
  double largest_m = 0, largest_turn = 0, largest_step = 0;
  PlayedInput before = *line.step();
  std::deque<std::uint64_t> last_ticks;
  std::uint64_t largest_advance = 0;
  const int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const PlayedInput played = *line.step();
    underruns += played.has_underrun;
    const RigidState truth = stirring(static_cast<double>(played.tick.value) * kInputPlayoutStep_s);
    EXPECT_NEAR(played.energy_from_hand_j, from_hand_j(played.tick.value), 1e-9) << "evenly, whatever was lost";
    EXPECT_NEAR(played.energy_to_hand_j, from_hand_j(played.tick.value) / 4, 1e-9);
    largest_m = std::max(largest_m, difference_m(played.handle, truth));
    largest_turn = std::max(largest_turn, played.handle.X.q.angularDistance(truth.X.q));
    largest_step = std::max(largest_step, static_cast<double>(played.tick.value - before.tick.value));
    before = played;
    last_ticks.push_back(played.tick.value);
    if (last_ticks.size() > InputPlayout::kCatchUpSteps) {
      largest_advance = std::max(largest_advance, last_ticks.back() - last_ticks.front());
      last_ticks.pop_front();
    }
  }
  RecordProperty("largest_um", static_cast<int>(1e6 * largest_m));
  // Bound of the error for the circular motion. Cubic interpolation over the longest gap T between received inputs has
  // an error of at most T⁴/384 max|x⁗| on each of two axes.
  const double gap_s = static_cast<double>(line.longest_gap) * kInputPlayoutStep_s;
  const double bound_m = std::numbers::sqrt2 * std::pow(gap_s, 4) / 384 * kHandReach_m * std::pow(kRate, 4);
  EXPECT_LE(gap_s, 0.1) << "a longer one is no gap but a silence";
  EXPECT_LE(largest_m, bound_m);
  EXPECT_LE(largest_turn, 1e-3);
  EXPECT_GT(largest_m, 0) << "nothing was lost, so nothing was tested";
  EXPECT_LE(largest_step, 2) << "the hand would jump";
  EXPECT_LE(largest_advance, InputPlayout::kCatchUpSteps + 2) << "the hand would hurry";
  EXPECT_LE(underruns, (1 - InputPlayout::kDelay.quantile) * steps * 1.5);
  EXPECT_LE(to_seconds(line.playout.delay()), to_seconds(InputPlayout::kDelay.longest) + 1e-9);
}

TEST(InputPlayout, WithoutItTheSameLineMovesTheHandByFarMore) {
  Line line(link_of(0.050, 0.010, 0.05));
  for (int i = 0; i < 3000; ++i) line.step();
  const double delay_s = to_seconds(line.playout.delay()) + 0.050;
  // Computes the error without playout: the newest received input is used at once. Compared at the same mean delay, the
  // error is the speed of the hand times the jitter.
  double largest_m = 0;
  std::uint64_t newest = 0;
  net::LinkParameters same = link_of(0.050, 0.010, 0.05);
  net::SimulatedLink link(same, 1, 1);
  for (std::uint64_t step = 1; step < 5000; ++step) {
    const LocalTime now{std::chrono::milliseconds(step)};
    std::array<std::byte, 8> packet{};
    std::memcpy(packet.data(), &step, sizeof step);
    link.send(now, packet);
    while (const auto received = link.receive(now)) std::memcpy(&newest, received->data(), sizeof newest);
    if (step < 200) continue;
    const double truth_s = static_cast<double>(step) * kInputPlayoutStep_s - 0.060;
    largest_m = std::max(largest_m,
                         difference_m(stirring(static_cast<double>(newest) * kInputPlayoutStep_s), stirring(truth_s)));
  }
  EXPECT_GT(largest_m, 5e-3);
  EXPECT_LT(delay_s, 0.120);
}

TEST(InputPlayout, AWorseNetworkIsFollowedNoFasterThanTheSlew) {
  InputPlayout playout(kInputPlayoutStep_s);
  std::uint64_t steps = 0;
  const auto step = [&](std::uint64_t late) {
    ++steps;
    const double now_s = static_cast<double>(steps) * kInputPlayoutStep_s;
    if (steps > late)
      playout.receive(input_of(steps - late, now_s - static_cast<double>(late) * kInputPlayoutStep_s),
                      from_seconds(now_s));
    return playout.play(from_seconds(now_s));
  };
  for (int i = 0; i < 4000; ++i) step(10);
  const double before_s = to_seconds(playout.delay());
  // From now on every input arrives 30 ms later. The playout delay must grow by 30 ms, but no faster than its slew
  // limit. It must not wait until the earlier, faster inputs have left the memory of 2 s.
  double last_s = before_s;
  for (int i = 0; i < 1000; ++i) {
    step(40);
    ASSERT_LE(to_seconds(playout.delay()) - last_s, InputPlayout::kDelay.slew * kInputPlayoutStep_s + 1e-12);
    last_s = to_seconds(playout.delay());
  }
  EXPECT_NEAR(last_s - before_s, 0.030, 0.001);
}

TEST(InputPlayout, FollowsAClockThatDriftsAndNeverSkipsMoreThanItMust) {
  // 200 ppm is far more than the drift of crystals. In 20 s the clocks diverge by 4 ms.
  for (const double drift : {200e-6, -200e-6}) {
    SCOPED_TRACE(drift);
    Line line(link_of(0.020, 0, 0), drift);
    for (int i = 0; i < 5000; ++i) line.step();
    int odd = 0;
    Tick before = line.step()->tick;
    for (int i = 0; i < 20000; ++i) {
      const PlayedInput played = *line.step();
      const std::uint64_t stride = played.tick.value - before.value;
      EXPECT_LE(stride, 2U);
      odd += stride != 1;
      before = played.tick;
      // Two inputs may arrive in one step; the first one is then lost. The motion at its tick is interpolated between
      // the neighbouring inputs, so the error must remain small.
      EXPECT_LE(difference_m(played.handle, stirring(static_cast<double>(before.value) * kInputPlayoutStep_s)), 1e-9);
    }
    // `odd` counts the steps in which the played tick does not advance by 1. In 20 s the clocks diverge by four ticks,
    // and each odd step corrects one tick. A correction is made after a drift of 0.75 ticks, so 3 to 5 are expected.
    // Changes of the delay estimate must cause none.
    EXPECT_NEAR(odd, 4, 1);
    EXPECT_LE(to_seconds(line.playout.delay()), 0.004);
  }
}

TEST(InputPlayout, HoldsTheLastWhenDryAndLetsItsMotionFade) {
  InputPlayout playout(kInputPlayoutStep_s);
  for (std::uint64_t tick = 1; tick <= 100; ++tick) {
    playout.receive(input_of(tick, static_cast<double>(tick) * kInputPlayoutStep_s), std::chrono::milliseconds(tick));
    playout.play(std::chrono::milliseconds(tick));
  }
  const RigidState last = stirring(0.1);
  std::optional<PlayedInput> played;
  double speed = last.V.v.norm();
  for (int i = 1; i <= 60; ++i) {
    played = playout.play(std::chrono::milliseconds(100 + i));
    ASSERT_TRUE(played);
    if (!played->has_underrun) continue;
    EXPECT_EQ(played->tick.value, 100U) << "the handle is exactly that of the tick that is answered";
    EXPECT_EQ(played->handle.X.p, last.X.p);
    EXPECT_LE(played->handle.V.v.norm(), speed);
    speed = played->handle.V.v.norm();
  }
  EXPECT_TRUE(played->has_underrun);
  EXPECT_EQ(speed, 0);
}

/// A hand moves at 0.15 m/s and stops at the tick `stops`. Its ticks from 1001 to 1085 are lost.
struct Gap {
  explicit Gap(std::uint64_t its_stop) : stops(its_stop) {
    for (std::uint64_t now = 1; now <= 1600; ++now) {
      if (now <= 1000 || now > 1085) playout.receive(input(now), std::chrono::milliseconds(now));
      auto step = playout.play(std::chrono::milliseconds(now));
      if (step->has_underrun) playout.run_on(*step);
      played_m.push_back(step->handle.X.p.x());
      ticks.push_back(step->tick.value);
      behind_m.push_back(place_m(now) - played_m.back());
    }
  }
  double place_m(std::uint64_t tick) const {
    return 0.15 * kInputPlayoutStep_s * static_cast<double>(std::min(tick, stops));
  }
  proto::ClientUpdate input(std::uint64_t tick) const {
    proto::ClientUpdate update = input_of(tick, static_cast<double>(tick) * kInputPlayoutStep_s);
    update.handle = {};
    update.handle.X.p.x() = place_m(tick);
    update.handle.V.v.x() = tick < stops ? 0.15 : 0;
    return update;
  }

  std::uint64_t stops;
  InputPlayout playout{kInputPlayoutStep_s};
  std::vector<double> played_m, behind_m;
  std::vector<std::uint64_t> ticks;
};

TEST(InputPlayout, RunsOnThroughAGapWithTheHandThatGoesOn) {
  const Gap gap(9000);
  EXPECT_LE(*std::max_element(gap.behind_m.begin(), gap.behind_m.begin() + 1085), 0.0035) << "it waits for 13 mm else";
  for (std::size_t i = 1; i < gap.played_m.size(); ++i) {
    const double moved_m = gap.played_m[i] - gap.played_m[i - 1];
    ASSERT_GE(moved_m, -1e-9) << i << ": not back";
    ASSERT_LE(moved_m, 2 * 0.15 * kInputPlayoutStep_s + 1e-9) << i << ": no jump";
  }
  EXPECT_NEAR(gap.behind_m.back(), 0.15 * to_seconds(gap.playout.delay()), 2 * 0.15 * kInputPlayoutStep_s)
      << "the offset must be gone";
}

TEST(InputPlayout, WhatRunsOnStandsForTheTickThatIsDueAndIsNearItsPlace) {
  const Gap gap(9000);
  for (std::size_t i = 500; i < gap.ticks.size(); ++i) {
    const std::uint64_t stride = gap.ticks[i] - gap.ticks[i - 1];
    ASSERT_LE(stride, 2U) << i << ": not back, no jump";
    ASSERT_LE(std::abs(gap.place_m(gap.ticks[i]) - gap.played_m[i]), 0.0035) << i;
  }
  EXPECT_GE(gap.ticks[1080], 1070U) << "the last that came is 1000";
}

TEST(InputPlayout, RunningOnWithAHandThatStoppedEndsWhereItStopped) {
  const Gap gap(1005);
  const double farthest_m = -*std::min_element(gap.behind_m.begin(), gap.behind_m.end());
  EXPECT_GT(farthest_m, 0.005);
  EXPECT_LE(farthest_m, InputPlayout::kRunOnMost_m);
  EXPECT_NEAR(gap.behind_m.back(), 0, 2e-4);
  for (std::size_t i = 1; i < gap.played_m.size(); ++i) {
    ASSERT_LE(std::abs(gap.played_m[i] - gap.played_m[i - 1]), 2 * 0.15 * kInputPlayoutStep_s + 1e-9)
        << i << ": no jump";
  }
}

TEST(InputPlayout, StartsAtTheFirstInputAndRestartsAfterALongSilence) {
  InputPlayout playout(kInputPlayoutStep_s);
  EXPECT_FALSE(playout.play(Duration{0}));
  playout.receive(input_of(7, 5.0), std::chrono::milliseconds(1));
  ASSERT_TRUE(playout.play(std::chrono::milliseconds(1)));
  EXPECT_EQ(playout.play(std::chrono::milliseconds(2))->tick.value, 7U) << "held until it is due";
  // After a silence of 1 s, the next input is 1 m away. The playout must jump to it and not interpolate towards it.
  proto::ClientUpdate far = input_of(1007, 6.0);
  far.handle.X.p += Vec3(1, 0, 0);
  playout.receive(far, std::chrono::milliseconds(1001));
  EXPECT_EQ(playout.play(std::chrono::milliseconds(1001))->handle.X.p, far.handle.X.p);
  playout.reset();
  EXPECT_FALSE(playout.play(std::chrono::milliseconds(1002)));
}

TEST(InputPlayout, HostileTimesAndTicksGiveFiniteStatesWithinTheLimits) {
  Random random(3);
  InputPlayout playout(kInputPlayoutStep_s);
  std::uint64_t tick = 1;
  for (std::uint64_t step = 1; step < 20000; ++step) {
    const double now_s = static_cast<double>(step) * kInputPlayoutStep_s;
    if (random.uniform() < 0.8) {
      tick += random.uniform() < 0.02 ? random.next_u64() : random.next_u32() % 4;
      proto::ClientUpdate input = input_of(tick, random.uniform() < 0.5 ? now_s : random.uniform(0, 2.3e9));
      if (random.uniform() < 0.5) input.sent = LocalTime(Duration(static_cast<Duration::rep>(step)));
      input.handle.V.v = Vec3(0, 0, random.uniform() < 0.5 ? proto::kMaxSpeedMPerS : -proto::kMaxSpeedMPerS);
      playout.receive(input, from_seconds(now_s));
    }
    if (random.uniform() < 0.01) playout.reset();
    auto played = playout.play(from_seconds(now_s));
    if (!played) continue;
    if (played->has_underrun) playout.run_on(*played);
    ASSERT_TRUE(is_finite(played->handle.X));
    ASSERT_LE(played->handle.V.v.norm(), proto::kMaxSpeedMPerS * (1 + 1e-9));
    ASSERT_LE(played->handle.V.w.norm(), proto::kMaxTurnRadPerS * (1 + 1e-9));
    ASSERT_NEAR(played->handle.X.q.norm(), 1, 1e-9);
    ASSERT_GE(to_seconds(playout.delay()), 0);
  }
}

}  // namespace
}  // namespace tandem::server
