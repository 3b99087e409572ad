#include "lab/therapy/hand_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/lab/therapy/minimum_jerk.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

HandMotion sampled(double seconds, double rate_hz, const auto& position) {
  MotionSampler sampler;
  for (int i = 0; i < static_cast<int>(seconds * rate_hz); ++i) sampler.add(i / rate_hz, position(i / rate_hz));
  return sampler.motion();
}

TEST(HandMotion, OfALineHasItsLengthAndSpeedAtEachRate) {
  for (const double rate_hz : {40.0, 125.0, 1000.0, 4000.0}) {
    const HandMotion motion = sampled(2, rate_hz, [](double t) { return Vec3(0.1 * t, 0, 0.05); });
    const double expected_m = 0.1 * motion.duration_s();
    EXPECT_NEAR(path_length_m(motion, 0, motion.p_W.size()), expected_m, 0.002) << rate_hz;
    for (std::size_t i = 5; i + 5 < motion.p_W.size(); ++i) ASSERT_NEAR(motion.speed_m_per_s[i], 0.1, 1e-6) << rate_hz;
  }
}

TEST(HandMotion, KeepsAGapAndNoPathIsAddedInIt) {
  MotionSampler sampler;
  for (int i = 0; i < 1000; ++i) sampler.add(i * 1e-3, Vec3(0, 0, 0));
  for (int i = 2000; i < 3000; ++i) sampler.add(i * 1e-3, Vec3(1, 0, 0));
  const HandMotion motion = sampler.motion();
  EXPECT_TRUE(motion.p_W[150].hasNaN());
  EXPECT_TRUE(motion.p_W[250].allFinite());
  EXPECT_NEAR(path_length_m(motion, 0, motion.p_W.size()), 0, 1e-12);
  EXPECT_TRUE(movements_of(motion).empty()) << "a jump across a gap is no movement";
}

TEST(HandMotion, ShortGapsAreFilled) {
  MotionSampler sampler;
  for (const double t_s : {0.0, 0.2, 0.21, 0.4}) sampler.add(t_s, Vec3(t_s, 0, 0));
  const HandMotion motion = sampler.motion();
  for (std::size_t i = 0; i < motion.p_W.size(); ++i) {
    EXPECT_NEAR(motion.p_W[i].x(), static_cast<double>(i) / kMotionRate_hz, 1e-9);
  }
}

TEST(HandMotion, IgnoresSamplesThatAreOutOfRange) {
  MotionSampler sampler;
  sampler.add(-1, Vec3::Zero());
  sampler.add(1e300, Vec3::Zero());
  sampler.add(std::numeric_limits<double>::quiet_NaN(), Vec3::Zero());
  sampler.add(1, Vec3(1e9, 0, 0));
  sampler.add(1, Vec3(0, std::numeric_limits<double>::infinity(), 0));
  EXPECT_TRUE(sampler.is_empty());
  EXPECT_EQ(sampler.ignored(), 5U);
  EXPECT_TRUE(movements_of(sampler.motion()).empty());
}

/// Movements of minimum jerk in random directions, with rests between them. The positions contain encoder noise.
struct Session {
  double seconds = 0;
  std::vector<Movement> movements;
  std::vector<Vec3> from, to;

  explicit Session(Random& random) {
    Vec3 at = Vec3::Zero();
    seconds = 0.6;
    for (int i = 0; i < 10; ++i) {
      const Vec3 direction = Vec3(random.normal(), random.normal(), random.normal()).normalized();
      const double duration_s = random.uniform(0.5, 2), length_m = random.uniform(0.06, 0.3);
      from.push_back(at);
      at += length_m * direction;
      to.push_back(at);
      movements.push_back({seconds, duration_s, length_m, 1.875 * length_m / duration_s, 0});
      seconds += duration_s + random.uniform(0.6, 1.5);
    }
  }
  Vec3 position(double t_s) const {
    std::size_t i = 0;
    while (i + 1 < movements.size() && t_s >= movements[i + 1].begin_s) ++i;
    return from[i] + minimum_jerk((t_s - movements[i].begin_s) / movements[i].duration_s) * (to[i] - from[i]);
  }
};

TEST(Movements, AreFoundWithTheirLengthAndSmoothness) {
  const double smooth = arc_length_of(minimum_jerk_spectrum);
  Random random(test::test_seed(20261203));
  for (int run = 0; run < 20; ++run) {
    const Session session(random);
    const HandMotion motion = sampled(session.seconds, 1000, [&](double t_s) {
      const auto noise = [&] { return random.uniform(-5e-6, 5e-6); };
      return Vec3(session.position(t_s) + Vec3(noise(), noise(), noise()));
    });
    const std::vector<Movement> found = movements_of(motion);
    ASSERT_EQ(found.size(), session.movements.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Movement& made = session.movements[i];
      EXPECT_NEAR(found[i].path_m, made.path_m, 0.002);
      EXPECT_NEAR(found[i].peak_speed_m_per_s, made.peak_speed_m_per_s, 0.02 * made.peak_speed_m_per_s + 0.002);
      EXPECT_GT(found[i].begin_s, made.begin_s - 0.02);
      EXPECT_LT(found[i].begin_s + found[i].duration_s, made.begin_s + made.duration_s + 0.02);
      EXPECT_NEAR(found[i].smoothness, smooth, 0.03) << made.path_m << " m in " << made.duration_s << " s";
    }
  }
}

TEST(Movements, WithTremorAreLessSmooth) {
  Random random(test::test_seed(20261204));
  for (int run = 0; run < 20; ++run) {
    const Session session(random);
    const double tremor_hz = random.uniform(4, 8);
    std::vector<double> medians;
    for (const double tremor_m : {0.0, 0.001, 0.002}) {
      const HandMotion motion = sampled(session.seconds, 500, [&](double t_s) {
        return Vec3(session.position(t_s) + Vec3(0, 0, tremor_m * std::sin(2 * std::numbers::pi * tremor_hz * t_s)));
      });
      std::vector<double> smoothness;
      for (const Movement& movement : movements_of(motion)) smoothness.push_back(movement.smoothness);
      medians.push_back(quantile(smoothness, 0.5));
    }
    // Tremor must lower the smoothness. The two larger tremors are compared only with the movement without tremor: once
    // the tremor is as fast as the movement, the smoothness does not fall further.
    EXPECT_LT(medians[1], medians[0] - 0.2) << tremor_hz;
    EXPECT_LT(medians[2], medians[0] - 0.2) << tremor_hz;
  }
}

TEST(Range, DoesNotCountOutliers) {
  const HandMotion clean = sampled(20, 200, [](double t) {
    return Vec3(0.1 * std::sin(t), 0.2 * std::sin(1.3 * t), 0.05 * std::sin(0.7 * t) + 0.3);
  });
  const HandMotion spoiled = sampled(20, 200, [](double t) {
    const bool is_outlier = std::fmod(t, 4) >= 1 && std::fmod(t, 4) < 1.02;
    return is_outlier ? Vec3(5, -5, 5)
                      : Vec3(0.1 * std::sin(t), 0.2 * std::sin(1.3 * t), 0.05 * std::sin(0.7 * t) + 0.3);
  });
  const auto expected = range_of(clean, 0, clean.p_W.size()), range = range_of(spoiled, 0, spoiled.p_W.size());
  ASSERT_TRUE(expected && range);
  EXPECT_LT((range->low_m - expected->low_m).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_LT((range->high_m - expected->high_m).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_NEAR(range->high_m.y(), 0.2, 0.002);
  EXPECT_NEAR(range->size_m().x(), 0.2, 0.002);
}

TEST(Range, HasTheReachFromTheStartInEachDirection) {
  // The hand rests for a second, and then reaches along each direction for a second.
  const HandMotion motion = sampled(7, 1000, [](double t) {
    const std::array<Vec3, 7> places{Vec3(1, 2, 3),   Vec3(0.9, 2, 3), Vec3(1.2, 2, 3), Vec3(1, 1.7, 3),
                                     Vec3(1, 2.4, 3), Vec3(1, 2, 2.5), Vec3(1, 2, 3.6)};
    return places.at(std::min<std::size_t>(6, static_cast<std::size_t>(t)));
  });
  const auto range = range_of(motion, 0, motion.p_W.size());
  ASSERT_TRUE(range);
  const std::vector<double> expected{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, reach = range->reach_m();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(reach[i], expected[i], 1e-9) << i;
  EXPECT_FALSE(range_of(motion, 0, 50)) << "half a second is too short";
}

TEST(Range, IsTheSameWithALongRest) {
  const auto moves = [](double t) { return Vec3(0.1 * std::sin(3 * t), 0, 0); };
  const HandMotion without = sampled(10, 200, moves);
  const HandMotion with = sampled(300, 200, [&](double t) { return moves(std::min(t, 10.0)); });
  const auto expected = range_of(without, 0, without.p_W.size()), range = range_of(with, 0, with.p_W.size());
  ASSERT_TRUE(expected && range);
  EXPECT_LT((range->size_m() - expected->size_m()).cwiseAbs().maxCoeff(), 0.001);
  EXPECT_NEAR(range->size_m().x(), 0.2, 0.001);
}

TEST(Quantile, InterpolatesAndSkipsUnknownValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(quantile({3, nan, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantile({1, 2}, 0.25), 1.25);
  EXPECT_EQ(quantile({1, 2}, 1), 2);
  EXPECT_TRUE(std::isnan(quantile({nan}, 0.5)));
}

}  // namespace
}  // namespace tandem::lab
