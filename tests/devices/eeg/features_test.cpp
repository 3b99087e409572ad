// Compares the filter, the features and the artefact flags with closed forms.
#include "devices/eeg/features.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "common/base/random.hpp"
#include "devices/eeg/artefacts.hpp"
#include "devices/eeg/band_pass.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::eeg {
namespace {

using std::numbers::pi;

std::vector<double> sine(std::size_t count, double frequency_hz, double rate_hz, double amplitude = 1) {
  std::vector<double> x(count);
  for (std::size_t n = 0; n < count; ++n)
    x[n] = amplitude * std::sin(2 * pi * frequency_hz * static_cast<double>(n) / rate_hz);
  return x;
}

/// Returns random series whose fractal dimension is known, 2 − hurst: fractional Brownian motion. They are cumulative
/// sums of fractional Gaussian noise, which Hosking's recursion generates.
///
/// Source  Hosking, "Modeling persistence in hydrological time series using fractional differencing", Water Resources
///         Research 20, 1984; exact for any covariance. The coefficients are computed once for all series
std::vector<std::vector<double>> fractional_motion(double hurst, std::size_t series, std::size_t count,
                                                   Random& random) {
  std::vector<double> covariance(count);
  for (std::size_t lag = 0; lag < count; ++lag) {
    const auto k = static_cast<double>(lag);
    const auto power = [&](double x) { return std::pow(std::abs(x), 2 * hurst); };
    covariance[lag] = 0.5 * (power(k + 1) - 2 * power(k) + power(k - 1));
  }
  std::vector<double> phi, next;
  double variance = 1;
  std::vector<std::vector<double>> noise(series), motion(series);
  for (std::size_t n = 0; n < count; ++n) {
    if (n > 0) {
      double reflection = covariance[n];
      for (std::size_t j = 0; j + 1 < n; ++j) reflection -= phi[j] * covariance[n - 1 - j];
      reflection /= variance;
      next = phi;
      for (std::size_t j = 0; j + 1 < n; ++j) next[j] -= reflection * phi[n - 2 - j];
      next.push_back(reflection);
      phi.swap(next);
      variance *= 1 - reflection * reflection;
    }
    for (std::size_t i = 0; i < series; ++i) {
      double mean = 0;
      for (std::size_t j = 0; j < n; ++j) mean += phi[j] * noise[i][n - 1 - j];
      noise[i].push_back(mean + std::sqrt(variance) * random.normal());
      motion[i].push_back((n > 0 ? motion[i].back() : 0) + noise[i].back());
    }
  }
  return motion;
}

TEST(Higuchi, OfASineIsThatOfTheFormula) {
  EXPECT_NEAR(higuchi_dimension(sine(3000, 1, 100)), 1.0074, 1e-4);
}

TEST(Higuchi, OfAnyRampIsOne) {
  for (const double slope : {1.0, -3e-6, 4e9}) {
    for (const std::size_t count : {30U, 511U, 3000U}) {
      std::vector<double> ramp(count);
      for (std::size_t n = 0; n < count; ++n) ramp[n] = slope * static_cast<double>(n) + 2;
      EXPECT_NEAR(higuchi_dimension(ramp), 1, 1e-9) << slope << " " << count;
    }
  }
  EXPECT_EQ(higuchi_dimension(std::vector<double>(512, 3.0)), 1) << "a constant signal is a ramp of slope 0";
}

TEST(Higuchi, OfFractionalBrownianMotionIsTwoMinusHurst) {
  constexpr std::size_t kSeries = 20;
  constexpr std::size_t kLength = 4096;
  Random random(test::test_seed(7));
  for (const double hurst : {0.2, 0.4, 0.6, 0.8}) {
    double mean = 0;
    for (const auto& motion : fractional_motion(hurst, kSeries, kLength, random))
      mean += higuchi_dimension(motion) / kSeries;
    EXPECT_NEAR(mean, 2 - hurst, 0.05) << "H = " << hurst;
  }
}

TEST(Picard, OfARampHasTheClosedForm) {
  constexpr std::size_t kCount = 512;
  constexpr double kSlope = 0.25;
  std::vector<double> ramp(kCount);
  for (std::size_t n = 0; n < kCount; ++n) ramp[n] = kSlope * static_cast<double>(n) - 7;
  const auto features = picard_features(ramp);
  // The numbers 0 to N−1 have the variance N(N+1)/12, with the divisor N−1.
  const double deviation = kSlope * std::sqrt(kCount * (kCount + 1) / 12.0);
  EXPECT_NEAR(features[0], kSlope * (kCount - 1) / 2 - 7, 1e-9);
  EXPECT_NEAR(features[1], deviation, 1e-9);
  EXPECT_NEAR(features[2], kSlope, 1e-12);
  EXPECT_NEAR(features[3], kSlope / deviation, 1e-12);
  EXPECT_NEAR(features[4], 2 * kSlope, 1e-12);
  EXPECT_NEAR(features[5], 2 * kSlope / deviation, 1e-12);
}

TEST(Picard, OfASquareWaveHasTheClosedForm) {
  std::vector<double> square(400);
  for (std::size_t n = 0; n < square.size(); ++n) square[n] = n % 2 == 0 ? 3.0 : -1.0;
  const auto features = picard_features(square);
  const double deviation = 2 * std::sqrt(400.0 / 399);
  EXPECT_NEAR(features[0], 1, 1e-12);
  EXPECT_NEAR(features[1], deviation, 1e-12);
  EXPECT_NEAR(features[2], 4, 1e-12);
  EXPECT_NEAR(features[3], 4 / deviation, 1e-12);
  EXPECT_EQ(features[4], 0) << "every second sample is the same";
  EXPECT_EQ(features[5], 0);
}

TEST(Picard, NormalisedFeaturesDoNotChangeWithScaleAndOffset) {
  Random random(test::test_seed(3));
  std::vector<double> x(512), y(512);
  for (std::size_t n = 0; n < x.size(); ++n) {
    x[n] = random.normal();
    y[n] = 40 * x[n] - 1000;
  }
  const auto a = picard_features(x), b = picard_features(y);
  EXPECT_NEAR(a[3], b[3], 1e-9);
  EXPECT_NEAR(a[5], b[5], 1e-9);
  EXPECT_NEAR(40 * a[2], b[2], 1e-9);
}

TEST(Picard, OfAConstantSignalIsFinite) {
  const auto features = picard_features(std::vector<double>(512, 0.1));
  EXPECT_NEAR(features[0], 0.1, 1e-12);
  for (std::size_t i = 1; i < features.size(); ++i) EXPECT_EQ(features[i], 0);
}

/// Returns the designed gain [dB]: the closed form of the Butterworth band-pass filter at the prewarped frequency.
double design_db(double f, double low_hz, double high_hz, double rate_hz) {
  const auto warped = [&](double hz) { return std::tan(pi * hz / rate_hz); };
  const double w = warped(f), low = warped(low_hz), high = warped(high_hz);
  const double q = (w * w - low * high) / ((high - low) * w);
  return -10 * std::log10(1 + std::pow(q, 2 * kPrototypeOrder));
}

TEST(BandPass, HasTheResponseOfItsDesign) {
  for (const double rate_hz : {100.0, 128.0, 256.0, 1000.0}) {
    const BandPass filter(2, 42, rate_hz);
    for (double f = 0.25; f < rate_hz / 2 - 1; f += 0.25) {
      const double design = design_db(f, 2, 42, rate_hz);
      if (design < -120) continue;  // below this gain, rounding errors dominate
      EXPECT_NEAR(20 * std::log10(std::abs(filter.response(f))), design, 0.1) << f << " Hz at " << rate_hz;
    }
    EXPECT_NEAR(20 * std::log10(std::abs(filter.response(2))), -3.01, 0.01);
    EXPECT_NEAR(20 * std::log10(std::abs(filter.response(42))), -3.01, 0.01);
  }
}

TEST(BandPass, TheGainOfASineIsThatOfTheFrequencyResponse) {
  for (const double f : {1.0, 2.0, 3.0, 10.0, 30.0, 42.0, 50.0}) {
    BandPass filter(2, 42, 128);
    double squares = 0;
    // The transient has ended after 20 s. The power is then measured over whole periods.
    const auto x = sine(128 * 40, f, 128);
    for (std::size_t n = 0; n < x.size(); ++n) {
      const double y = filter.step(x[n]);
      if (n >= x.size() / 2) squares += y * y / (static_cast<double>(x.size()) / 2);
    }
    EXPECT_NEAR(20 * std::log10(std::sqrt(2 * squares)), design_db(f, 2, 42, 128), 0.1) << f << " Hz";
  }
}

TEST(BandPass, AnOffsetCausesNoTransient) {
  BandPass filter(2, 42, 128);
  for (int n = 0; n < 1000; ++n) ASSERT_EQ(filter.step(4200), 0);
}

TEST(BandPass, AnImpossibleBandIsRefused) {
  for (const auto& [low, high, rate] : {std::tuple{0.0, 42.0, 128.0}, {42.0, 2.0, 128.0}, {2.0, 64.0, 128.0}})
    EXPECT_THROW(BandPass(low, high, rate), std::invalid_argument) << low << " " << high << " " << rate;
}

class Artefacts : public testing::Test {
 protected:
  void SetUp() override {
    Random random(11);
    raw_.resize(512);
    for (double& x : raw_) x = 10 * random.normal();
  }
  std::uint8_t flags() const { return artefacts_in(raw_, raw_, 128, ConverterRange{-4096, 4095}, {}); }

  std::vector<double> raw_;
};

TEST_F(Artefacts, OfPlainEegAreNone) {
  EXPECT_EQ(flags(), 0);
}

TEST_F(Artefacts, AFlatLine) {
  raw_.assign(512, 17);
  EXPECT_EQ(flags(), kFlat);
}

TEST_F(Artefacts, Clipping) {
  for (std::size_t n = 100; n < 110; ++n) raw_[n] = 4095;
  EXPECT_EQ(flags() & kClipped, kClipped);
}

TEST_F(Artefacts, ABlink) {
  for (std::size_t n = 0; n < 40; ++n) raw_[200 + n] += 250 * std::pow(std::sin(pi * static_cast<double>(n) / 40), 2);
  EXPECT_EQ(flags(), kAmplitude);
}

TEST_F(Artefacts, HumOfEitherMains) {
  const std::vector<double> eeg = raw_;
  for (const double line_hz : {50.0, 60.0}) {
    const auto hum = sine(512, line_hz, 128, 40);
    for (std::size_t n = 0; n < hum.size(); ++n) raw_[n] = eeg[n] + hum[n];
    EXPECT_EQ(flags(), kLineNoise) << line_hz;
  }
  const auto beta = sine(512, 40, 128, 40);
  for (std::size_t n = 0; n < beta.size(); ++n) raw_[n] = eeg[n] + beta[n];
  EXPECT_EQ(flags(), 0) << "40 Hz is EEG";
}

TEST_F(Artefacts, AStep) {
  for (std::size_t n = 256; n < 512; ++n) raw_[n] += 400;
  EXPECT_EQ(flags() & kStep, kStep);
}

TEST_F(Artefacts, ALostSample) {
  raw_[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(flags(), kLost);
}

TEST(ArtefactText, NamesEachFlag) {
  EXPECT_EQ(artefact_text(0), "");
  EXPECT_EQ(artefact_text(kFlat | kStep), "flat+step");
}

}  // namespace
}  // namespace tandem::eeg
