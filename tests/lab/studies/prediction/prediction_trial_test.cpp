#include "lab/studies/prediction/prediction_trial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/random.hpp"
#include "lab/studies/prediction/ar_of_series.hpp"

namespace tandem::lab {
namespace {

/// Returns a series of a force along x, sampled at 1 kHz.
template <class Force>
ForceSeries series_of(double length_s, const Force& force) {
  ForceSeries series{"test", "", {}};
  for (int k = 0; k <= static_cast<int>(length_s * 1000); ++k) {
    ForceSample sample;
    sample.at = std::chrono::milliseconds(k);
    sample.on_hand_W.f.x() = force(k / 1000.0);
    series.samples.push_back(sample);
  }
  return series;
}

TEST(PredictionTrial, HoldOnARampErrsByItsMeanAge) {
  const ForceSeries ramp = series_of(1, [](double t) { return 3 * t; });
  haptics::ForceStream hold(haptics::force_stream_settings("hold"));
  const PredictionErrors errors = predict_series(ramp, hold);
  // The force rises by 3 N/s, and its samples are sent every 5 ms and held. Thus the error of a tick is 3 N/s times the
  // age of its sample. The ages 0, 1, 2, 3 and 4 ms occur 200 times each (mean 2 ms). The last tick adds a 201st age of
  // 0 ms.
  EXPECT_NEAR(errors.force.mean, 3e-3 * 2 * 1000 / 1001, 1e-9);
  EXPECT_NEAR(errors.force.largest, 0.012, 1e-9);
  // The variance of the ages 0, 1, 2, 3 and 4 ms is 2 ms². Multiplied by the square of the slope 3 N/s, it gives the
  // variance of the error, 1.8e-5 N².
  EXPECT_NEAR(errors.force.variance, 9e-6 * 2, 5e-8);
  EXPECT_NEAR(errors.step_max_n, 0.015, 1e-9);
  EXPECT_EQ(errors.stream.samples, 201U);
}

TEST(PredictionTrial, ADelayIsAnAge) {
  const ForceSeries ramp = series_of(1, [](double t) { return 3 * t; });
  haptics::ForceStream hold(haptics::force_stream_settings("hold"));
  constexpr Duration kPeriod = std::chrono::milliseconds(5);
  constexpr Duration kLate = std::chrono::milliseconds(10);
  EXPECT_NEAR(predict_series(ramp, hold, kPeriod, kLate).force.mean, 3e-3 * 12, 1e-4);
  haptics::ForceStream linear(haptics::force_stream_settings("linear"));
  // The prediction is exact except at the first sample, because a line needs two samples.
  EXPECT_LT(predict_series(ramp, linear, kPeriod, kLate).force.mean, 3e-3 * 12 / 50);
}

TEST(PredictionTrial, AChangeBetweenTwoSentSamplesIsSentWithTheNextOne) {
  // The force steps by 0.8 N, eight times its noise of 0.1 N. Such a step resets the predictor only if a contact change
  // is flagged: the threshold is then 5 times the noise, and 12 times without a flag.
  Random random(5);
  ForceSeries series = series_of(1, [&](double t) { return 0.1 * random.normal() + (t < 0.502 ? 0 : 0.8); });
  haptics::ForceStream plain, flagged;
  const std::uint64_t before = predict_series(series, plain).stream.resets;
  // The change occurs between the sent samples of 500 and 505 ms.
  series.samples[502].has_contact_changed = true;
  EXPECT_EQ(predict_series(series, flagged).stream.resets, before + 1);
}

TEST(PredictionTrial, BetweenUnevenSamplesTheTruthIsTheLine) {
  ForceSeries series{"test", "", {}};
  for (const int ms : {0, 3, 10, 12}) {
    ForceSample sample;
    sample.at = std::chrono::milliseconds(ms);
    sample.on_hand_W.f.z() = 2 * ms;
    series.samples.push_back(sample);
  }
  haptics::ForceStream hold(haptics::force_stream_settings("hold"));
  const PredictionErrors errors = predict_series(series, hold, Duration(0));
  ASSERT_EQ(errors.true_n.size(), 13U);
  for (int ms = 0; ms <= 12; ++ms) EXPECT_NEAR(errors.true_n[static_cast<std::size_t>(ms)].z(), 2 * ms, 1e-9);
  EXPECT_NEAR(errors.shown_n[9].z(), 6, 1e-12);
}

TEST(ArOfSeries, EvenAxesAreTheLineBetweenSamples) {
  const ForceSeries ramp = series_of(1, [](double t) { return 3 * t; });
  const auto axes = even_axes(ramp, 200);
  ASSERT_EQ(axes[0].size(), 201U);
  EXPECT_NEAR(axes[0][77], 3 * 0.385, 1e-12);
  EXPECT_EQ(axes[5][77], 0);
  const auto steps = differences(axes[0]);
  ASSERT_EQ(steps.size(), 200U);
  EXPECT_NEAR(steps[10], 0.015, 1e-12);
}

TEST(ArOfSeries, FixedModelsAreThoseOfTheWholeSeries) {
  Random random(2);
  double before = 0;
  const ForceSeries series = series_of(20, [&](double) { return before = 0.9 * before + random.normal(); });
  haptics::ForceStreamSettings settings;
  settings.series_rate_hz = 1000;
  settings.order = 1;
  settings.is_on_differences = false;
  const haptics::ArModels models = models_of(series, settings);
  EXPECT_NEAR(models[0].phi[0], 0.9, 4 * std::sqrt((1 - 0.81) / 20'000));
  EXPECT_EQ(models[3].order, 0U) << "a torque of zero has no model";
}

}  // namespace
}  // namespace tandem::lab
