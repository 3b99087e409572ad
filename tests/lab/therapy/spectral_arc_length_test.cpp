#include "lab/therapy/spectral_arc_length.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/lab/therapy/minimum_jerk.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::lab {
namespace {

constexpr double kRate_hz = 100;

/// Tolerance of the arc length. The discrete Fourier transform has a frequency spacing of 1/16 of the inverse duration.
/// Its cut-off frequency is therefore up to one spacing below that of the continuous spectrum. Within one spacing, the
/// spectrum near the threshold changes by up to 0.02, and the arc length by about as much.
constexpr double kTolerance = 0.02;

TEST(SpectralArcLength, OfMinimumJerkIsItsClosedFormForEachDurationAndAmplitude) {
  const double expected = arc_length_of(minimum_jerk_spectrum);
  EXPECT_NEAR(expected, -1.41, 0.005);
  Random random(test::test_seed(20261201));
  for (int i = 0; i < 200; ++i) {
    const double duration_s = random.uniform(0.3, 5), length_m = random.uniform(1e-3, 1);
    const auto speed = minimum_jerk_profile(length_m, duration_s, kRate_hz);
    EXPECT_NEAR(spectral_arc_length(speed, kRate_hz), expected, kTolerance) << duration_s << " s, " << length_m << " m";
  }
}

TEST(SpectralArcLength, OfAGaussianIsItsClosedForm) {
  const double expected = arc_length_of([](double k) { return std::exp(-k * k / 2); });
  for (const double width_s : {0.05, 0.1, 0.3}) {
    std::vector<double> speed;
    for (double t_s = -8 * width_s; t_s <= 8 * width_s; t_s += 1 / kRate_hz) {
      speed.push_back(0.2 * std::exp(-t_s * t_s / (2 * width_s * width_s)));
    }
    EXPECT_NEAR(spectral_arc_length(speed, kRate_hz), expected, kTolerance) << width_s;
  }
}

TEST(SpectralArcLength, IsLoweredByTremorAndMoreByMoreTremor) {
  Random random(test::test_seed(20261202));
  for (int i = 0; i < 100; ++i) {
    const double duration_s = random.uniform(1, 3), length_m = random.uniform(0.1, 0.3);
    const double tremor_hz = random.uniform(4, 8);
    const auto smooth = minimum_jerk_profile(length_m, duration_s, kRate_hz);
    double before = spectral_arc_length(smooth, kRate_hz);
    for (const double share : {0.2, 0.5, 1.0}) {  // tremor as a fraction of the mean speed
      std::vector<double> speed = smooth;
      for (std::size_t k = 0; k < speed.size(); ++k) {
        const double t_s = static_cast<double>(k) / kRate_hz;
        speed[k] =
            std::abs(speed[k] + share * length_m / duration_s * std::sin(2 * std::numbers::pi * tremor_hz * t_s));
      }
      const double now = spectral_arc_length(speed, kRate_hz);
      EXPECT_LT(now, before - 0.02) << tremor_hz << " Hz, share " << share << ", " << duration_s << " s";
      before = now;
    }
  }
}

/// The expected values come from an independent program in Python that follows the authors' smoothness.py. It pads to a
/// power of two with the padding level 4, and divides the magnitude by its maximum. It uses frequencies up to 10 Hz and
/// up to the last magnitude of at least 0.05.
TEST(SpectralArcLength, AgreesWithAnIndependentProgram) {
  struct Case {
    int samples;
    double rate_hz, share, expected;
  };
  for (const Case& one : {Case{101, 100, 0, -1.405829324421465},
                          {101, 100, 0.3, -1.7904027061313468},
                          {101, 100, 1.5, -2.69799343627433},
                          {250, 100, 0.3, -2.0085310464399835},
                          {250, 100, 1.5, -3.5434035489961833},
                          {300, 120, 1.5, -3.0135554009069816}}) {
    std::vector<double> speed;
    for (int i = 0; i < one.samples; ++i) {
      speed.push_back(std::abs(minimum_jerk_speed(i / (one.samples - 1.0)) + one.share * std::sin(0.31 * i)));
    }
    EXPECT_NEAR(spectral_arc_length(speed, one.rate_hz), one.expected, 1e-9) << one.samples << ", " << one.share;
  }
}

TEST(SpectralArcLength, OfTwoSubmovementsIsLowerThanOfOne) {
  std::vector<double> speed = minimum_jerk_profile(0.1, 0.8, kRate_hz);
  const double one = spectral_arc_length(speed, kRate_hz);
  const std::vector<double> first = speed;
  speed.insert(speed.end(), first.begin(), first.end());
  EXPECT_LT(spectral_arc_length(speed, kRate_hz), one - 0.2);
}

TEST(SpectralArcLength, OfBadInputIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const std::vector<std::vector<double>> bad{{},
                                             {1, 2},
                                             {0, 0, 0, 0},
                                             {0, 1, nan, 1},
                                             {0, infinite, 0},
                                             {0, -1, 0},
                                             std::vector<double>(kMaxSpeedSamples + 1, 1.0)};
  for (const auto& speed : bad) EXPECT_TRUE(std::isnan(spectral_arc_length(speed, kRate_hz))) << speed.size();
  EXPECT_TRUE(std::isnan(spectral_arc_length(minimum_jerk_profile(1, 1, kRate_hz), 20)));
  const std::vector<double> huge{0, 1e308, 1.7e308, 1e308, 0};
  EXPECT_TRUE(std::isfinite(spectral_arc_length(huge, kRate_hz)));
}

}  // namespace
}  // namespace tandem::lab
