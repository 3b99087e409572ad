#include "devices/eeg/sources/generator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/base/random.hpp"

namespace tandem::eeg {
namespace {

constexpr double kModulation = 0.3;    ///< change of ln(amplitude) of a rhythm per unit of z (GeneratorSettings)
constexpr double kBackgroundUv = 4.0;  ///< standard deviation of each low-pass noise of the background
constexpr double kAlphaUv = 8.0, kBetaUv = 5.0;
constexpr double kBlinkUv = 250, kBlinkS = 0.3, kBadContactS = 10, kHumUv = 80;
constexpr std::array kPinkHz{0.3, 1.0, 3.0, 10.0, 30.0};

/// First-order low-pass noise with standard deviation 1. Several of them are added to obtain a spectrum of
/// approximately 1/f; their corner frequencies are evenly spaced on a logarithmic scale.
class LowPassNoise {
 public:
  LowPassNoise(double corner_hz, double rate_hz) : pole_(std::exp(-2 * std::numbers::pi * corner_hz / rate_hz)) {}
  double step(Random& random) { return value_ = pole_ * value_ + std::sqrt(1 - pole_ * pole_) * random.normal(); }

 private:
  double pole_;
  double value_ = 0;
};

/// A rhythm of the EEG, simulated as narrow-band noise with standard deviation 1. It is the sum of a sine and a cosine
/// carrier, each with low-pass noise as its amplitude.
class Rhythm {
 public:
  Rhythm(double frequency_hz, double width_hz, double rate_hz)
      : cosine_(width_hz / 2, rate_hz),
        sine_(width_hz / 2, rate_hz),
        turn_(2 * std::numbers::pi * frequency_hz / rate_hz) {}
  double step(Random& random) {
    phase_ = std::fmod(phase_ + turn_, 2 * std::numbers::pi);
    return cosine_.step(random) * std::cos(phase_) + sine_.step(random) * std::sin(phase_);
  }

 private:
  LowPassNoise cosine_, sine_;
  double turn_;
  double phase_ = 0;
};

/// Signal of one electrode: 1/f background, alpha rhythm and beta rhythm.
class Electrode {
 public:
  explicit Electrode(double rate_hz) : alpha_(10, 2, rate_hz), beta_(20, 6, rate_hz) {
    for (const double corner_hz : kPinkHz) background_.emplace_back(corner_hz, rate_hz);
  }
  double step(double z, Random& random) {
    double sum = 0;
    for (LowPassNoise& one : background_) sum += kBackgroundUv * one.step(random);
    const double gain = std::exp(kModulation * z);
    return sum + kAlphaUv * gain * alpha_.step(random) + kBetaUv / gain * beta_.step(random);
  }

 private:
  std::vector<LowPassNoise> background_;
  Rhythm alpha_, beta_;
};

/// Returns the states of the blocks. Each pair of blocks has both states, in random order.
std::vector<bool> states_of(std::size_t blocks, Random& random) {
  std::vector<bool> states(blocks);
  for (std::size_t i = 0; i < blocks; i += 2) {
    states[i] = random.uniform() < 0.5;
    if (i + 1 < blocks) states[i + 1] = !states[i];
  }
  return states;
}

void add_blinks(const GeneratorSettings& settings, Recording& recording, Random& random) {
  const double length_s = static_cast<double>(recording.length()) / settings.rate_hz;
  if (settings.blinks_per_min <= 0) return;
  for (double at_s = random.exponential(60 / settings.blinks_per_min); at_s + kBlinkS < length_s;
       at_s += kBlinkS + random.exponential(60 / settings.blinks_per_min)) {
    recording.annotations.push_back({at_s, kBlinkS, "blink"});
    const auto begin = static_cast<std::size_t>(at_s * settings.rate_hz);
    const auto count = static_cast<std::size_t>(kBlinkS * settings.rate_hz);
    for (std::size_t i = 0; i <= count && begin + i < recording.length(); ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(count);
      const double uv = kBlinkUv * std::pow(std::sin(std::numbers::pi * part), 2);
      recording.samples_uv.front()[begin + i] += uv;
      recording.samples_uv.back()[begin + i] += uv;
    }
  }
}

void add_bad_contacts(const GeneratorSettings& settings, Recording& recording, Random& random) {
  const double length_s = static_cast<double>(recording.length()) / settings.rate_hz;
  if (settings.bad_contacts_per_hour <= 0) return;
  const double mean_s = 3600 / settings.bad_contacts_per_hour;
  for (double at_s = random.exponential(mean_s); at_s + kBadContactS < length_s;
       at_s += kBadContactS + random.exponential(mean_s)) {
    const auto channel = static_cast<std::size_t>(random.uniform() * static_cast<double>(recording.samples_uv.size()));
    const bool is_hum = random.uniform() < 0.5;
    recording.annotations.push_back({at_s, kBadContactS, "bad contact " + settings.channels[channel]});
    const auto begin = static_cast<std::size_t>(at_s * settings.rate_hz);
    const auto end = std::min(recording.length(), begin + static_cast<std::size_t>(kBadContactS * settings.rate_hz));
    for (std::size_t n = begin; n < end; ++n) {
      const double hum = kHumUv * std::sin(2 * std::numbers::pi * 50 * static_cast<double>(n) / settings.rate_hz);
      recording.samples_uv[channel][n] = is_hum ? recording.samples_uv[channel][n] + hum : 0;
    }
  }
}

void require(bool is_good, const std::string& text) {
  if (!is_good) throw std::invalid_argument(text);
}

}  // namespace

void check(const GeneratorSettings& settings) {
  require(settings.bayes_accuracy >= 0.5 && settings.bayes_accuracy <= 0.999, "--bayes-accuracy must be 0.5 to 0.999");
  require(settings.rate_hz >= 100 && settings.rate_hz <= 2048 && settings.rate_hz == std::floor(settings.rate_hz),
          "--sample-rate must be a whole number from 100 to 2048 Hz");
  require(settings.blocks >= 2 && settings.blocks <= 1000, "--blocks must be 2 to 1000");
  require(settings.windows_per_block >= 1 && settings.windows_per_block <= 1000, "--windows must be 1 to 1000");
  require(settings.window >= 64 && settings.window <= 65536, "--window must be 64 to 65536 samples");
  require(settings.block_effect >= 0 && settings.block_effect <= 3, "--block-effect must be 0 to 3");
  require(settings.blinks_per_min >= 0 && settings.blinks_per_min <= 60, "--blinks must be 0 to 60 per minute");
  require(settings.bad_contacts_per_hour >= 0 && settings.bad_contacts_per_hour <= 120,
          "--bad-contacts must be 0 to 120 per hour");
  require(!settings.channels.empty() && settings.channels.size() <= kMaxChannels, "--channels must be 1 to 256 names");
  const auto samples = settings.blocks * settings.windows_per_block * settings.window * settings.channels.size();
  require(samples <= kMaxFileSamples,
          "--blocks: " + std::to_string(samples) + " samples are more than a file may have");
}

Recording generate(const GeneratorSettings& settings) {
  check(settings);
  // States, artefacts and signals use separate random streams. States and artefacts therefore do not depend on the
  // number of channels.
  Random states_random(settings.seed, 3 * settings.session), random(settings.seed, 3 * settings.session + 1);
  Random artefacts(settings.seed, 3 * settings.session + 2);
  Recording recording{
      .origin = "generator", .format = {settings.channels, settings.rate_hz, {}}, .samples_uv = {}, .annotations = {}};
  recording.samples_uv.resize(settings.channels.size());
  for (std::vector<double>& one : recording.samples_uv)
    one.reserve(settings.blocks * settings.windows_per_block * settings.window);
  std::vector<Electrode> electrodes(settings.channels.size(), Electrode(settings.rate_hz));
  const double shift = normal_quantile(settings.bayes_accuracy);
  const double window_s = static_cast<double>(settings.window) / settings.rate_hz;
  const double block_s = window_s * static_cast<double>(settings.windows_per_block);
  for (const bool is_positive : states_of(settings.blocks, states_random)) {
    const double onset_s = static_cast<double>(recording.length()) / settings.rate_hz;
    recording.annotations.push_back({onset_s, block_s, is_positive ? settings.positive : settings.negative});
    const double of_block = settings.block_effect * random.normal();
    for (std::size_t w = 0; w < settings.windows_per_block; ++w) {
      const double z = (is_positive ? shift : -shift) + of_block + random.normal();
      for (std::size_t n = 0; n < settings.window; ++n) {
        for (std::size_t i = 0; i < electrodes.size(); ++i)
          recording.samples_uv[i].push_back(electrodes[i].step(z, random));
      }
    }
  }
  add_blinks(settings, recording, artefacts);
  add_bad_contacts(settings, recording, artefacts);
  return recording;
}

EdfContent edf_from(const Recording& recording, bool is_bdf) {
  EdfContent content{.is_bdf = is_bdf, .record_s = 1, .signals = {}, .annotations = recording.annotations};
  const int digital_max = is_bdf ? 8'388'607 : 32'767;
  const double physical_min = is_bdf ? -262'144 : -4096, step_uv = is_bdf ? 0.03125 : 0.125;
  const auto rate = static_cast<std::size_t>(recording.format.rate_hz);
  const std::size_t whole = recording.length() / rate * rate;
  for (std::size_t i = 0; i < recording.samples_uv.size(); ++i) {
    EdfSignal signal{.name = "EEG " + recording.format.channels[i],
                     .unit = "uV",
                     .samples_per_record = static_cast<int>(rate),
                     .digital_min = -digital_max - 1,
                     .digital_max = digital_max,
                     .physical_min = physical_min,
                     .physical_max = is_bdf ? 262'143 : 4095.875,
                     .digital = {}};
    for (std::size_t n = 0; n < whole; ++n) {
      const double value = std::round(recording.samples_uv[i][n] / step_uv);
      signal.digital.push_back(static_cast<std::int32_t>(
          std::clamp(value, static_cast<double>(signal.digital_min), static_cast<double>(digital_max))));
    }
    content.signals.push_back(std::move(signal));
  }
  return content;
}

double normal_quantile(double p) {
  // Bisection is fast enough, because the function is called once for a recording.
  double low = -40, high = 40;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace tandem::eeg
