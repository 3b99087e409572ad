#include "common/haptics/prediction/force_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr Duration kForceStreamPeriod = milliseconds(5);

LocalTime at_ms(double ms) {
  return LocalTime(Duration(static_cast<Duration::rep>(ms * 1e6)));
}
/// Returns a wrench in which each axis has `value` times another factor.
Wrench all_axes(double value) {
  return {Vec3(value, -value, 2 * value), Vec3(0.1 * value, value, -0.3 * value)};
}
double seconds(LocalTime time) {
  return to_seconds(time.time_since_epoch());
}

ForceStreamSettings settings_of(std::string_view name) {
  return force_stream_settings(name);
}

/// Adds a sample of `force` every kForceStreamPeriod from 0 to `end_s`, and runs a fit after each sample.
void feed(ForceStream& stream, double end_s, const std::function<double(double)>& force) {
  for (LocalTime now{}; seconds(now) <= end_s; now += kForceStreamPeriod) {
    stream.push(now, all_axes(force(seconds(now))));
    stream.fit();
  }
}

/// Returns the mean of |output − true force| in x over all ticks after the first second. Samples arrive every 5 ms.
double mean_error(ForceStream& stream, double end_s, const std::function<double(double)>& force) {
  double sum = 0;
  int count = 0;
  for (LocalTime now{}; seconds(now) <= end_s; now += milliseconds(1)) {
    if (now.time_since_epoch() % kForceStreamPeriod == Duration(0)) stream.push(now, all_axes(force(seconds(now))));
    stream.fit();
    const double shown = stream.at(now).f.x();
    if (seconds(now) < 1) continue;
    sum += std::abs(shown - force(seconds(now)));
    ++count;
  }
  return sum / count;
}

TEST(ForceStream, HoldIsTheNewestSampleHoweverOld) {
  ForceStream stream(settings_of("hold"));
  stream.push(at_ms(0), all_axes(1));
  stream.push(at_ms(5), all_axes(3));
  for (const double ms : {5.0, 9.0, 80.0, 1e6}) {
    EXPECT_EQ(stream.at(at_ms(ms)).f, all_axes(3).f);
    EXPECT_EQ(stream.at(at_ms(ms)).t, all_axes(3).t);
  }
}

TEST(ForceStream, LinearIsTheLineThroughTheLastTwoByTheMeasuredAge) {
  ForceStream stream(settings_of("linear"));
  for (int k = 0; k <= 20; ++k) stream.push(at_ms(5 * k), all_axes(0.1 * k));
  // The slope is 0.1 N per 5 ms = 0.02 N/ms. The samples range from 0 to 2 N. The output may exceed this range by its
  // width, so its limit is 4 N.
  EXPECT_NEAR(stream.at(at_ms(103)).f.x(), 2.06, 1e-12);
  EXPECT_NEAR(stream.at(at_ms(130)).f.y(), -2.6, 1e-12);
  EXPECT_NEAR(stream.at(at_ms(130)).t.z(), -0.78, 1e-12);
}

TEST(ForceStream, ASinusoidIsForeseenBetterThanByALine) {
  const auto sine = [](double t) { return 3 * std::sin(2 * std::numbers::pi * 12 * t); };
  ForceStream linear(settings_of("linear"));
  const double by_line = mean_error(linear, 3, sine);
  for (const char* name : {"ar", "ar-spline"}) {
    ForceStream stream(settings_of(name));
    // The bounds follow from two errors, with the second derivative f'' of the force, the period T and the age u in
    // periods:
    // - linear extrapolation: f'' T² u(1+u)/2
    // - exact predictions at the periods, with linear interpolation between them: at most f'' T²/8
    const double bound = std::string_view(name) == "ar" ? 0.4 : 0.15;
    EXPECT_LT(mean_error(stream, 3, sine), bound * by_line) << name;
  }
}

TEST(ForceStream, OnASmoothRampIsTheLine) {
  const auto ramp = [](double t) { return 2 * t; };
  for (const char* name : {"ar", "ar-spline"}) {
    ForceStream stream(settings_of(name)), line(settings_of("linear"));
    feed(stream, 2, ramp);
    feed(line, 2, ramp);
    for (const double age_ms : {0.0, 1.0, 4.0, 20.0}) {
      const double expected = line.at(at_ms(2000 + age_ms)).f.x();
      EXPECT_NEAR(expected, 2 * (2 + age_ms / 1e3), 1e-9);
      EXPECT_NEAR(stream.at(at_ms(2000 + age_ms)).f.x(), expected, 2e-4) << name << ", " << age_ms;
    }
  }
}

TEST(ForceStream, OnNoiseIsNoWorseThanHold) {
  for (const char* name : {"ar", "ar-spline"}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      // The force is white noise at 1 kHz. Only its return to the mean can be predicted.
      std::vector<double> noise;
      Random random(seed);
      for (int i = 0; i <= 20'000; ++i) noise.push_back(1 + 0.3 * random.normal());
      const auto force = [&](double t) { return noise[static_cast<std::size_t>(std::lround(t * 1000))]; };
      ForceStream stream(settings_of(name)), hold(settings_of("hold")), linear(settings_of("linear"));
      const double held = mean_error(hold, 20, force);
      EXPECT_LT(mean_error(stream, 20, force), held) << name << ", seed " << seed;
      EXPECT_GT(mean_error(linear, 20, force), 1.2 * held) << seed;
    }
  }
}

TEST(ForceStream, TheLiteralSplineIsOnePeriodLateAndTheOtherIsNot) {
  const auto sine = [](double t) { return std::sin(2 * std::numbers::pi * 2 * t); };
  // Returns the delay of the sinusoid that fits the output with the least squared error.
  const auto lag_ms = [&](ForceStream& stream) {
    std::vector<std::pair<double, double>> shown;
    for (LocalTime now{}; seconds(now) <= 4; now += milliseconds(1)) {
      if (now.time_since_epoch() % kForceStreamPeriod == Duration(0)) stream.push(now, all_axes(sine(seconds(now))));
      stream.fit();
      if (seconds(now) > 2) shown.emplace_back(seconds(now), stream.at(now).f.x());
    }
    double best = 0, least = std::numeric_limits<double>::max();
    for (double lag = -5; lag <= 15; lag += 0.05) {
      double sum = 0;
      for (const auto& [t, value] : shown) sum += std::pow(value - sine(t - lag / 1e3), 2);
      if (sum < least) best = lag;
      least = std::min(least, sum);
    }
    return best;
  };
  ForceStream literal(settings_of("literal")), spline(settings_of("ar-spline"));
  EXPECT_NEAR(lag_ms(literal), 5, 0.5);
  EXPECT_NEAR(lag_ms(spline), 0, 0.1);
}

TEST(ForceStream, TheSplineGoesThroughItsSamples) {
  ForceStream stream(settings_of("ar-spline"));
  Random random(4);
  for (int k = 0; k < 500; ++k) {
    const double value = random.normal();
    stream.push(at_ms(5 * k), all_axes(value));
    stream.fit();
    ASSERT_NEAR(stream.at(at_ms(5 * k)).f.x(), value, 1e-12);
  }
}

/// Returns the largest change of the second difference quotient between consecutive steps, over the whole output of a
/// stream.
double largest_bend_change(ForceStream& stream, Duration step) {
  std::vector<double> shown;
  Random random(8);
  const double dt = to_seconds(step);
  for (LocalTime now{}; seconds(now) < 0.3; now += step) {
    if (now.time_since_epoch() % kForceStreamPeriod == Duration(0)) {
      stream.push(now, all_axes(std::sin(40 * seconds(now)) + 0.1 * random.normal()));
    }
    stream.fit();
    if (seconds(now) > 0.2) shown.push_back(stream.at(now).f.x());
  }
  double largest = 0;
  for (std::size_t i = 3; i < shown.size(); ++i) {
    const double third = shown[i] - 3 * shown[i - 1] + 3 * shown[i - 2] - shown[i - 3];
    largest = std::max(largest, std::abs(third) / (dt * dt));
  }
  return largest;
}

TEST(ForceStream, TheBlendedSplineHasTwoContinuousDerivatives) {
  ForceStreamSettings blended = settings_of("ar-spline");
  blended.blend = milliseconds(4);
  ForceStream coarse(blended), fine(blended);
  // The step is ten times smaller for `fine`. For a C² curve, the change of the second derivative decreases with the
  // step. If the value or one of the first two derivatives jumps, the change stays equal or grows.
  const double at_coarse = largest_bend_change(coarse, microseconds(50));
  const double at_fine = largest_bend_change(fine, microseconds(5));
  EXPECT_LT(at_fine, 0.2 * at_coarse);
  ForceStream corrected(settings_of("ar-spline"));
  EXPECT_GT(largest_bend_change(corrected, microseconds(5)), 100 * at_coarse) << "samples that surprise are jumps";
}

TEST(ForceStream, IrregularArrivalsAreASeriesOfEvenRate) {
  const auto smooth = [](double t) { return 2 * std::sin(2 * std::numbers::pi * 3 * t); };
  ForceStream stream(settings_of("ar-spline")), hold(settings_of("hold"));
  Random random(6);
  LocalTime sampled{};
  LocalTime next = sampled;
  double error = 0, held = 0;
  int count = 0;
  for (LocalTime now{}; seconds(now) < 6; now += milliseconds(1)) {
    while (next <= now) {
      sampled = next;
      for (ForceStream* one : {&stream, &hold}) one->push(sampled, all_axes(smooth(seconds(sampled))));
      next += from_seconds(random.uniform(0.002, 0.012));
    }
    stream.fit();
    const double shown = stream.at(now).f.x();
    if (seconds(now) < 1) continue;
    error += std::abs(shown - smooth(seconds(now)));
    held += std::abs(hold.at(now).f.x() - smooth(seconds(now)));
    ++count;
  }
  EXPECT_LT(error, 0.12 * held);
  EXPECT_GT(stream.figures().fits, 100U);
  EXPECT_EQ(stream.figures().rejected, 0U);
}

TEST(ForceStream, AContactChangeForgetsTheModelButNotTheLine) {
  ForceStream stream(settings_of("ar"));
  const auto sine = [](double t) { return std::sin(60 * t); };
  feed(stream, 1.5, sine);
  ASSERT_EQ(stream.figures().resets, 0U);
  ASSERT_GT(stream.figures().model_weight[0], 0.5);
  stream.push(at_ms(1505), all_axes(-4), true);
  EXPECT_EQ(stream.figures().resets, 1U);
  EXPECT_EQ(stream.figures().model_weight[0], 0);
  // The io thread has started a fit before the reset. The result belongs to the old series and must not be used.
  stream.fit();
  stream.push(at_ms(1510), all_axes(-4.1), false);
  EXPECT_EQ(stream.figures().model_weight[0], 0);
}

TEST(ForceStream, AnUnflaggedOnsetIsDetectedInTheSeries) {
  ForceStream stream(settings_of("ar"));
  feed(stream, 1, [](double t) { return 0.01 * std::sin(50 * t); });
  const std::uint64_t before = stream.figures().resets;
  stream.push(at_ms(1005), all_axes(3));
  EXPECT_EQ(stream.figures().resets, before + 1);
}

TEST(ForceStream, AFlaggedChangeThatWasPredictedChangesNothing) {
  ForceStream stream(settings_of("ar"));
  const auto sine = [](double t) { return std::sin(30 * t); };
  feed(stream, 1, sine);
  const std::uint64_t before = stream.figures().resets;
  stream.push(at_ms(1005), all_axes(sine(1.005)), true);
  EXPECT_EQ(stream.figures().resets, before);
}

TEST(ForceStream, TheOutputStaysNearTheReceivedForces) {
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name));
    // The force rises more and more steeply and then stops. This is the worst case for an extrapolation.
    feed(stream, 1, [](double t) { return std::expm1(3 * t); });
    const double top = std::expm1(3.0);
    for (double ms = 1000; ms < 3000; ms += 1) {
      const double shown = stream.at(at_ms(ms)).f.x();
      ASSERT_LE(shown, 2 * top + 1e-9) << name;
      ASSERT_GE(shown, -top - 1e-9) << name;
    }
  }
}

TEST(ForceStream, NoInputMakesTheOutputInfinite) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name));
    EXPECT_EQ(stream.at(at_ms(3)).f, Vec3::Zero());
    Random random(13);
    LocalTime now{};
    std::uint64_t bad = 0;
    const std::array values{0.0, 1.0, -1e6, 1e6, 1e-300, kNan, 1e308, -std::numeric_limits<double>::infinity(), 3.0};
    for (int k = 0; k < 20'000; ++k) {
      now += Duration(static_cast<Duration::rep>(random.uniform(-1e6, 2e7)));
      const double value = values[random.next_u32() % values.size()];
      stream.push(now, {Vec3(value, 1, value), Vec3(0, value, 1)}, random.uniform() < 0.1);
      bad += !std::isfinite(value) || std::abs(value) > 1e6 ? 1 : 0;
      if (random.uniform() < 0.5) stream.fit();
      const LocalTime queried = now + Duration(static_cast<Duration::rep>(random.uniform(-1e9, 1e9)));
      const Wrench shown = stream.at(queried);
      ASSERT_TRUE(is_finite(shown)) << name << ", " << k;
      ASSERT_LE(shown.f.cwiseAbs().maxCoeff(), 3e6 + 1) << name;
      if (k % 5000 == 4999) stream.reset();
    }
    EXPECT_GE(stream.figures().rejected, bad) << name;
    EXPECT_GT(stream.figures().samples, 5000U) << name;
  }
}

TEST(ForceStream, ForgetsEverythingAtAReset) {
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name)), fresh(settings_of(name));
    feed(stream, 1, [](double t) { return std::sin(40 * t); });
    stream.reset();
    EXPECT_EQ(stream.at(at_ms(1010)).f, Vec3::Zero()) << name;
    // Time starts again at 0, as after a new connection. The stream must behave like a new one.
    for (int k = 0; k < 100; ++k) {
      for (ForceStream* one : {&stream, &fresh}) {
        one->push(at_ms(5 * k), all_axes(std::cos(0.3 * k)));
        one->fit();
      }
      ASSERT_EQ(stream.at(at_ms(5 * k + 3)).f, fresh.at(at_ms(5 * k + 3)).f) << name << ", " << k;
    }
  }
}

TEST(ForceStream, PushAndAtAllocateNothing) {
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name));
    std::uint64_t allocated = 0;
    for (int k = 0; k < 2000; ++k) {
      const Wrench wrench = all_axes(std::sin(0.1 * k) + (k % 400 == 399 ? 3 : 0));
      const std::uint64_t before = test::allocation_count();
      stream.push(at_ms(5 * k), wrench, k % 400 == 399);
      for (int j = 0; j < 5; ++j) stream.at(at_ms(5 * k + j));
      if (k == 1500) stream.reset();
      allocated += test::allocation_count() - before;
      stream.fit();
    }
    EXPECT_EQ(allocated, 0U) << name;
  }
}

TEST(ForceStream, AFitIsRequestedOnlyByPredictorsThatUseIt) {
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name));
    bool has_requested = false;
    for (int k = 0; k < 400; ++k) {
      stream.push(at_ms(5 * k), all_axes(std::sin(0.1 * k)));
      has_requested |= stream.fit_pending();
      if (stream.fit_pending()) {
        EXPECT_TRUE(stream.fit());
      }
      EXPECT_FALSE(stream.fit());
    }
    EXPECT_EQ(has_requested, name != "hold" && name != "linear") << name;
  }
}

TEST(ForceStream, AllListedNamesCanBeCreated) {
  for (const std::string_view name : force_stream_names()) {
    const auto stream = make_force_stream(name);
    ASSERT_NE(stream, nullptr);
    EXPECT_EQ(name_of(stream->settings().method), name);
    EXPECT_THAT(listed_force_stream_names(), HasSubstr(std::string(name)));
  }
  EXPECT_EQ(make_force_stream("crystal ball"), nullptr);
  EXPECT_THROW(force_stream_settings("crystal ball"), std::invalid_argument);
}

TEST(ForceStream, SettingsOutOfRangeAreNamed) {
  const auto complaint = [](const std::function<void(ForceStreamSettings&)>& spoil) -> std::string {
    ForceStreamSettings settings;
    spoil(settings);
    try {
      const ForceStream stream(settings);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint([](ForceStreamSettings&) {}), "");
  EXPECT_THAT(complaint([](ForceStreamSettings& s) { s.order = 0; }), HasSubstr("order"));
  EXPECT_THAT(complaint([](ForceStreamSettings& s) { s.order = 17; }), HasSubstr("16"));
  EXPECT_THAT(complaint([](ForceStreamSettings& s) { s.window = 5000; }), HasSubstr("window"));
  EXPECT_THAT(complaint([](ForceStreamSettings& s) { s.series_rate_hz = std::nan(""); }), HasSubstr("series_rate_hz"));
  EXPECT_THAT(complaint([](ForceStreamSettings& s) { s.blend = -milliseconds(1); }), HasSubstr("blend"));
}

/// Returns a random gap from 1 ns to one year, uniform in its logarithm. One tenth of the gaps are negative.
Duration random_gap(Random& random) {
  const auto size = static_cast<Duration::rep>(std::exp(random.uniform(0, std::log(3.2e16))));
  return Duration(random.uniform() < 0.1 ? -size : size);
}

TEST(ForceStream, NoGapCostsMoreThanAWindowOrLeavesTheRange) {
  Random random(test::test_seed(59));
  for (const std::string_view name : force_stream_names()) {
    ForceStream stream(settings_of(name));
    LocalTime sampled{};
    for (int k = 0; k < 5000; ++k) {
      // Half of the samples arrive regularly, so that the stream fits models and tracks their errors. An irregular gap
      // could damage this state.
      sampled += random.uniform() < 0.5 ? kForceStreamPeriod : random_gap(random);
      const std::uint64_t before = stream.figures().resampled;
      stream.push(sampled, all_axes(random.uniform(-5, 5)), random.uniform() < 0.1);
      ASSERT_LE(stream.figures().resampled - before, stream.settings().window) << name << ", sample " << k;
      stream.fit();
      const Wrench shown = stream.at(sampled + random_gap(random));
      // all_axes() doubles one axis, whose samples range from −10 to 10 N. The output may exceed this range by its
      // width, 20 N, on each side.
      ASSERT_TRUE(is_finite(shown)) << name << ", sample " << k;
      ASSERT_LE(shown.f.cwiseAbs().maxCoeff(), 30 + 1e-9) << name << ", sample " << k;
    }
  }
}

}  // namespace
}  // namespace tandem::haptics
