// Tests playout with a constant delay: how many samples arrive in time, how smooth the motion is, and that the playout
// time never runs backwards.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/random.hpp"
#include "common/net/playout.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::net {
namespace {

Duration ms(double value) {
  return from_seconds(value * 1e-3);
}

/// Returns a sinusoidal motion along x with an amplitude of 10 mm at 2 Hz.
RigidState swing(double t_s) {
  constexpr double kTurns = 2 * 3.14159265358979 * 2;
  RigidState state;
  state.X.p.x() = 0.010 * std::sin(kTurns * t_s);
  state.V.v.x() = 0.010 * kTurns * std::cos(kTurns * t_s);
  return state;
}

struct Packet {
  Duration sampled{0};
  Duration arrived{0};
};

/// Returns one packet per millisecond for 10 s, in order of arrival. The link has a delay of 50 ms ± 10 ms (σ) and
/// loses 5 % of the packets in bursts of 20 ms.
std::vector<Packet> over_a_bad_link() {
  Random random(7, 1);
  std::vector<Packet> packets;
  Duration last{0};
  bool is_bad = false;
  for (int k = 0; k < 10000; ++k) {
    is_bad = is_bad ? random.uniform() > 1.0 / 20 : random.uniform() < 1.0 / 380;
    const Duration arrived = std::max(last, ms(k + std::max(0.0, 50 + 10 * random.normal())));
    if (is_bad) continue;
    last = arrived;
    packets.push_back({ms(k), arrived});
  }
  return packets;
}

struct Played {
  double worst_m = 0;     ///< largest deviation from the true motion at the playout time, after settling [m]
  double dry_share = 0;   ///< fraction of the time in which the newest sample is older than the playout time (underrun)
  double least_rate = 1;  ///< minimum rate of the playout time; 1: real time
  double most_rate = 1;
};

Played played(const std::vector<Packet>& packets, const PlayoutSettings& settings) {
  PlayoutDelay delay(settings);
  RigidTrack track;
  Played result;
  std::size_t next = 0;
  Duration before{0};
  int dry = 0, ticks = 0;
  for (int k = 60; k < 9900; ++k) {
    const Duration now = ms(k);
    for (; next < packets.size() && packets[next].arrived <= now; ++next) {
      delay.add(packets[next].sampled, now);
      track.add(packets[next].sampled, swing(to_seconds(packets[next].sampled)));
    }
    if (!delay.has_started()) continue;
    const Duration at = delay.play_at(now);
    if (k > 3000) {
      ++ticks;
      dry += at > track.newest_time() ? 1 : 0;
      result.worst_m = std::max(result.worst_m, std::abs(track.at(at).X.p.x() - swing(to_seconds(at)).X.p.x()));
      const double rate = to_seconds(at - before) / 1e-3;
      result.least_rate = std::min(result.least_rate, rate);
      result.most_rate = std::max(result.most_rate, rate);
    }
    before = at;
  }
  result.dry_share = static_cast<double>(dry) / ticks;
  return result;
}

TEST(PlayoutDelay, CoversJitterAndBurstsForAboutItsQuantileOfTheTime) {
  const auto packets = over_a_bad_link();
  EXPECT_LT(played(packets, {.quantile = 0.98}).dry_share, 0.03);
  // A playout that ignores the quantile always uses the longest delay. With the quantile 0.5, many more samples must
  // arrive too late.
  EXPECT_GT(played(packets, {.quantile = 0.5}).dry_share, 0.2);
}

TEST(PlayoutDelay, PlaysASwingAsItWas) {
  // If a sample arrives after its playout time (an underrun), the motion of up to 0.126 m/s is braked within 20 ms. A
  // burst of losses causes the longest underrun.
  EXPECT_LT(played(over_a_bad_link(), {}).worst_m, 0.004);
}

TEST(RigidTrack, FillsAGapAsTheCubicDoes) {
  // A Hermite cubic over a gap g has an error of at most x⁗ g⁴ / 384. Here the fourth derivative is x⁗ = 10 mm ·
  // (4π/s)⁴.
  constexpr double kGap_s = 0.06;
  const double bound_m = 0.010 * std::pow(4 * 3.14159265358979, 4) * std::pow(kGap_s, 4) / 384;
  RigidTrack track;
  for (int k = 0; k < 20; ++k) track.add(from_seconds(k * kGap_s), swing(k * kGap_s));
  double worst_m = 0;
  for (int k = 0; k < 1000; ++k) {
    worst_m = std::max(worst_m, std::abs(track.at(ms(k)).X.p.x() - swing(k * 1e-3).X.p.x()));
  }
  EXPECT_LE(worst_m, bound_m * 1.001);
  EXPECT_GT(worst_m, bound_m * 0.5);
}

TEST(PlayoutDelay, TimeNeverRunsBackwardsNorFasterThanItsSlew) {
  const Played result = played(over_a_bad_link(), {});
  EXPECT_GE(result.least_rate, 0.95 - 1e-6);
  EXPECT_LE(result.most_rate, 1.05 + 1e-6);
}

TEST(PlayoutDelay, WaitsOneGapOnAPerfectLink) {
  PlayoutDelay delay;
  for (int k = 0; k < 3000; ++k) {
    delay.add(ms(k), ms(k + 30));
    delay.play_at(ms(k + 30));
  }
  // Tolerance: the interval of 1 ms between samples, plus half a bin of the histogram from which the delay is chosen.
  EXPECT_LE(delay.delay(), ms(1.5));
}

TEST(PlayoutDelay, IgnoresSamplesOutOfOrder) {
  PlayoutDelay delay;
  for (int k = 0; k < 100; ++k) delay.add(ms(k), ms(k));
  const Duration before = delay.play_at(ms(100));
  delay.add(ms(50), ms(100));
  EXPECT_EQ(delay.play_at(ms(100)), before);
}

TEST(RigidTrack, InterpolatesPositionAndTurn) {
  RigidTrack track;
  RigidState a, b;
  b.X.p.x() = 0.010;
  a.V.v.x() = b.V.v.x() = 1.0;
  b.X.q = quaternion_of(Vec3(0, 0, 0.2));
  track.add(ms(100), a);
  track.add(ms(110), b);
  const RigidState middle = track.at(ms(105));
  EXPECT_NEAR(middle.X.p.x(), 0.005, 1e-12);
  EXPECT_NEAR(rotation_vector(middle.X.q).z(), 0.1, 1e-12);
}

TEST(RigidTrack, BrakesToRestWithoutNews) {
  RigidTrack track;
  RigidState state;
  state.V.v.x() = 0.1;
  track.add(ms(0), state);
  // Uniform braking from 0.1 m/s to rest within 20 ms covers 1 mm.
  EXPECT_NEAR(track.at(ms(20)).X.p.x(), 0.001, 1e-12);
  EXPECT_NEAR(track.at(ms(500)).X.p.x(), 0.001, 1e-12);
  EXPECT_EQ(track.at(ms(500)).V.v.norm(), 0);
  EXPECT_NEAR(track.at(ms(10)).V.v.x(), 0.05, 1e-12);
}

TEST(RigidTrack, KeepsTheNewestWhenItIsFull) {
  RigidTrack track;
  for (std::size_t k = 0; k < 3 * RigidTrack::kSamples; ++k) {
    RigidState state;
    state.X.p.x() = static_cast<double>(k);
    track.add(ms(static_cast<double>(k)), state);
  }
  const double last = static_cast<double>(3 * RigidTrack::kSamples - 1);
  EXPECT_EQ(track.newest().X.p.x(), last);
  EXPECT_NEAR(track.at(ms(last - 1.5)).X.p.x(), last - 1.5, 1e-9);
  // For a time before the stored samples, the oldest sample is returned.
  EXPECT_EQ(track.at(ms(0)).X.p.x(), last + 1 - static_cast<double>(RigidTrack::kSamples));
}

/// Returns a random gap from 1 ns to 70 years, uniform in its logarithm.
Duration random_gap(Random& random) {
  return Duration(static_cast<Duration::rep>(std::exp(random.uniform(0, std::log(2.2e18)))));
}

TEST(RigidTrack, NoStampMovesAThingFartherThanItsSpeedInTheLongestGap) {
  constexpr double kPlace_m = 1000, kSpeed_m_per_s = 1000;
  Random random(test::test_seed(59));
  for (int trial = 0; trial < 2000; ++trial) {
    RigidTrack track;
    Duration sampled{0};
    for (int k = 0; k < 10; ++k) {
      RigidState state;
      state.X.p.x() = random.uniform(-kPlace_m, kPlace_m);
      state.V.v.x() = random.uniform(-kSpeed_m_per_s, kSpeed_m_per_s);
      sampled = std::min(sampled + random_gap(random), Duration(std::int64_t{1} << 61U));
      track.add(sampled, state);
      const RigidState at = track.at(sampled - random_gap(random) / 2);
      ASSERT_LE(std::abs(at.X.p.x()), kPlace_m + kSpeed_m_per_s * to_seconds(RigidTrack::kMaxGap))
          << "trial " << trial << ", sample " << k;
    }
  }
}

TEST(PlayoutDelay, NoStampMakesTheDelayLongerThanItsLimit) {
  constexpr PlayoutSettings kSettings{};
  Random random(test::test_seed(59));
  for (int trial = 0; trial < 500; ++trial) {
    PlayoutDelay delay(kSettings);
    Duration sampled{0}, now = std::chrono::seconds(10);
    for (int k = 0; k < 50; ++k) {
      now += ms(random.uniform(0, 500));
      sampled = std::min(sampled + random_gap(random), Duration(std::int64_t{1} << 61U));
      delay.add(sampled, now);
      // The delay must be within its bounds between add() and play_at() as well.
      ASSERT_LE(delay.delay(), kSettings.longest + ms(200)) << "trial " << trial << ", sample " << k;
      ASSERT_GE(delay.delay(), Duration{0});
      delay.play_at(now);
      ASSERT_LE(delay.delay(), kSettings.longest + ms(200)) << "trial " << trial << ", sample " << k;
    }
  }
}

}  // namespace
}  // namespace tandem::net
