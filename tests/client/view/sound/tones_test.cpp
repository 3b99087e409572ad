#include "client/view/sound/tones.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::client {
namespace {

int peak_of(const std::vector<std::int16_t>& samples) {
  int peak = 0;
  for (const int sample : samples) peak = std::max(peak, std::abs(sample));
  return peak;
}

TEST(Tones, AreShortAudibleAndBeginAndEndWithoutAClick) {
  for (std::size_t i = 0; i < kSounds; ++i) {
    const auto samples = samples_of(static_cast<Sound>(i), 1);
    EXPECT_GT(samples.size(), kSampleRate_hz / 50U) << i;
    EXPECT_LE(samples.size(), static_cast<std::size_t>(kMaxSound_s * kSampleRate_hz)) << i;
    EXPECT_EQ(samples.front(), 0) << i;
    EXPECT_LT(std::abs(samples.back()), 20) << i;
    EXPECT_GT(peak_of(samples), 4000) << i;
    EXPECT_LE(peak_of(samples), std::numeric_limits<std::int16_t>::max() / 2) << i;
    int step = 0;
    for (std::size_t k = 1; k < samples.size(); ++k) step = std::max(step, std::abs(samples[k] - samples[k - 1]));
    EXPECT_LT(step, 3000) << i << ": a step is heard as a click";
  }
}

TEST(Tones, TheLoudnessScalesThemWithinBounds) {
  const int loud = peak_of(samples_of(Sound::kContact, 1));
  EXPECT_NEAR(peak_of(samples_of(Sound::kContact, 0.5)), loud / 2, 2);
  EXPECT_EQ(peak_of(samples_of(Sound::kContact, 0)), 0);
  EXPECT_EQ(peak_of(samples_of(Sound::kContact, 1e9)), loud);
  EXPECT_EQ(peak_of(samples_of(Sound::kContact, -1)), 0);
  EXPECT_EQ(peak_of(samples_of(Sound::kContact, std::nan(""))), 0);
}

TEST(Tones, Differ) {
  for (std::size_t i = 0; i < kSounds; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NE(samples_of(static_cast<Sound>(i), 1), samples_of(static_cast<Sound>(j), 1)) << i << ", " << j;
    }
  }
}

}  // namespace
}  // namespace tandem::client
