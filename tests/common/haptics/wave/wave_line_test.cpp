// Tests the equations of waves in closed form, and one direction of a line. For the line, the played wave is compared
// with the received one.
#include "common/haptics/wave/wave_line.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <vector>

#include "common/base/random.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

Wave wave_x(double value) {
  return {Vec3(value, 0, 0), Vec3::Zero()};
}

TEST(Waves, HalfTheirSquaresDifferByThePower) {
  const WaveImpedance b{7.0, 0.03};
  const Twist V{Vec3(0.1, -0.2, 0.05), Vec3(1, 2, -3)};
  const Wrench F{Vec3(3, 1, -2), Vec3(0.01, 0.2, 0.03)};
  const Wave u = wave_towards_tool(b, V, F), v = wave_towards_hand(b, V, F);
  const double power_w = F.f.dot(V.v) + F.t.dot(V.w);
  EXPECT_NEAR((squared(u) - squared(v)) / 2, power_w, 1e-12);
  const Twist V_back = velocity_of_waves(b, u, v);
  const Wrench F_back = wrench_of_waves(b, u, v);
  EXPECT_LT((V_back.v - V.v).norm() + (V_back.w - V.w).norm(), 1e-12);
  EXPECT_LT((F_back.f - F.f).norm() + (F_back.t - F.t).norm(), 1e-12);
}

TEST(WaveSum, GoesRoundWithoutLosingADifference) {
  Wave sum;
  Wave last;
  double total = 0;
  for (int i = 0; i < 1000; ++i) {
    sum = wave_sum(sum, wave_x(50), 0.1);
    total += wave_difference(sum, last).f.x();
    last = sum;
    ASSERT_LT(std::abs(last.f.x()), kWaveSumRange + 1e-9);
  }
  EXPECT_NEAR(total, 5000, 1e-6) << "more than the whole range of 4096";
}

TEST(WavePlayer, PlaysAConstantWaveAsItWasSent) {
  WavePlayer player({});
  Wave sum;
  Wave played;
  for (int k = 0; k < 1000; ++k) {
    sum = wave_sum(sum, wave_x(2), 0.001);
    if (k % 5 == 0) player.receive(std::chrono::milliseconds(k), sum);
    played = player.play(0.001);
  }
  EXPECT_NEAR(played.f.x(), 2, 1e-9);
  EXPECT_LE(player.waiting_s(), 0.005) << "no more than the gap between arrivals";
}

/// Energies of a random wave before and after a line with jitter, loss and duplicates.
struct Delivered {
  double in_j = 0;
  double out_j = 0;
  double worst_j = -std::numeric_limits<double>::infinity();  ///< maximum of out_j − in_j over time
  Wave missing;  ///< remainder of the wave's integral after everything was played
};

Delivered deliver(std::uint64_t seed, double loss, double skipped_share) {
  Random random(seed);
  WavePlayer::Settings settings;
  settings.skipped_share = skipped_share;
  WavePlayer player(settings);
  Wave sum;
  struct Message {
    int due;
    Duration sent;
    Wave sum;
  };
  std::vector<Message> way;
  Delivered result;
  Wave wave;
  for (int k = 0; k < 6000; ++k) {
    if (k % 40 == 0) wave = {5 * Vec3(random.normal(), random.normal(), random.normal()), Vec3(random.normal(), 0, 0)};
    if (k >= 4000) wave = {};
    sum = wave_sum(sum, wave, 0.001);
    if (k > 0) result.missing += wave * 0.001;
    result.in_j += squared(wave) * 0.001 / 2;
    if (random.uniform() >= loss || k == 4100) {
      way.push_back({k + 20 + static_cast<int>(40 * random.uniform()), std::chrono::milliseconds(k), sum});
    }
    for (const Message& message : way) {
      if (message.due == k || message.due == k - 7) player.receive(message.sent, message.sum);
    }
    const Wave played = player.play(0.001);
    result.missing = result.missing - played * 0.001;
    result.out_j += squared(played) * 0.001 / 2;
    result.worst_j = std::max(result.worst_j, result.out_j - result.in_j);
  }
  return result;
}

TEST(WavePlayer, NeverOutputsMoreEnergyThanItReceived) {
  for (const double loss : {0.0, 0.3, 0.9}) {
    for (int i = 0; i < 10; ++i) {
      const std::uint64_t seed = test::test_seed(static_cast<std::uint64_t>(i));
      SCOPED_TRACE("loss " + std::to_string(loss) + ", seed " + std::to_string(seed));
      const Delivered delivered = deliver(seed, loss, 0.05);
      EXPECT_LE(delivered.worst_j, 1e-9);
      EXPECT_GT(delivered.out_j, 0.02 * delivered.in_j) << "the player must output some of the energy";
    }
  }
}

TEST(WavePlayer, AfterLossNothingOfTheIntegralIsMissing) {
  const Delivered delivered = deliver(test::test_seed(3), 0.3, 0);
  EXPECT_LT(std::sqrt(squared(delivered.missing)), 0.1)
      << "only waves sent before the first arrival may be missing, about 20 ms";
  EXPECT_GT(delivered.in_j, 10);
}

TEST(WavePlayer, TheDelayDecreasesAgainAfterABurstOfLoss) {
  WavePlayer player({});
  Wave sum;
  double after_burst_s = 0;
  for (int k = 0; k < 6000; ++k) {
    sum = wave_sum(sum, wave_x(2), 0.001);
    if (k < 1000 || k > 1060) player.receive(std::chrono::milliseconds(k), sum);
    player.play(0.001);
    if (k == 1100) after_burst_s = player.waiting_s();
  }
  EXPECT_GT(after_burst_s, 0.05);
  EXPECT_LT(player.waiting_s(), 0.01);
}

TEST(WavePlayer, TakesMoreArrivalsThanItHasRoomForWithoutLosingAny) {
  WavePlayer::Settings settings;
  settings.skipped_share = 0;
  WavePlayer player(settings);
  Wave sum;
  player.receive(Duration{0}, sum);
  for (int k = 1; k <= 600; ++k) {
    sum = wave_sum(sum, wave_x(2), 0.001);
    player.receive(std::chrono::milliseconds(k), sum);
  }
  double played = 0;
  for (int k = 0; k < 700; ++k) played += player.play(0.001).f.x() * 0.001;
  EXPECT_NEAR(played, 1.2, 1e-6);
}

TEST(WavePlayer, IgnoresSumsThatAreNotFiniteNotNewerOrAfterALongSilence) {
  WavePlayer player({});
  player.receive(std::chrono::milliseconds(1), wave_x(0));
  player.receive(std::chrono::milliseconds(2), wave_x(std::numeric_limits<double>::quiet_NaN()));
  player.receive(std::chrono::milliseconds(1), wave_x(1));
  player.receive(std::chrono::milliseconds(0), wave_x(1));
  player.receive(std::chrono::seconds(5), wave_x(1));
  EXPECT_EQ(squared(player.play(0.001)), 0);
  EXPECT_EQ(squared(player.play(std::numeric_limits<double>::quiet_NaN())), 0);
  EXPECT_EQ(squared(player.play(0)), 0);
}

TEST(WavePlayer, PlaysNothingOfASumThatStartedAnew) {
  WavePlayer player({});
  Wave sum;
  for (int k = 0; k < 100; ++k) {
    sum = wave_sum(sum, wave_x(2), 0.001);
    player.receive(std::chrono::milliseconds(k), sum);
  }
  for (int k = 0; k < 200; ++k) player.play(0.001);
  for (int k = 100; k < 110; ++k) player.receive(std::chrono::milliseconds(k), Wave{});
  for (int k = 0; k < 20; ++k) ASSERT_LT(std::sqrt(squared(player.play(0.001))), 1e-6);
}

TEST(WavePlayer, NoSendersClockMakesMoreWaitThanItsLimit) {
  Random random(test::test_seed(59));
  for (int trial = 0; trial < 50; ++trial) {
    WavePlayer player({});
    Wave sum;
    Duration sent{0};
    for (int k = 0; k < 2000; ++k) {
      // The sender's clock may run up to a thousand times as fast as the local clock. The queue must stay bounded
      // nevertheless.
      const double gap_s = std::exp(random.uniform(std::log(1e-6), std::log(1.5)));
      sent += from_seconds(gap_s);
      sum = wave_sum(sum, wave_x(random.uniform(-1, 1)), gap_s);
      player.receive(sent, sum);
      ASSERT_LE(player.waiting_s(), WavePlayer::kMaxWaiting_s) << "trial " << trial << ", sample " << k;
      ASSERT_TRUE(is_finite(player.play(0.001)));
    }
  }
}

}  // namespace
}  // namespace tandem::haptics
