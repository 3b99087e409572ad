#include "client/view/sound/tones.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace tandem::client {
namespace {

struct Partial {
  double frequency_hz, gain, decay_s, start_s;
};

constexpr double kAttack_s = 0.001, kEnd_s = 0.005;
constexpr double kPeak = 16'000;  ///< peak of a sound at full gain: about half of the range of a sample

/// The sound of a contact is a knock with inharmonic partials, like a struck block of wood. All other sounds consist of
/// two tones: rising for a grasp and a reached goal, falling for a release and a failure.
constexpr Partial kContact[] = {{190, 0.6, 0.018, 0}, {523, 0.3, 0.010, 0}, {1021, 0.1, 0.005, 0}};
constexpr Partial kGrasp[] = {{392, 0.5, 0.025, 0}, {587, 0.5, 0.030, 0.045}};
constexpr Partial kRelease[] = {{587, 0.5, 0.025, 0}, {392, 0.5, 0.030, 0.045}};
constexpr Partial kGoal[] = {{523, 0.5, 0.06, 0}, {784, 0.5, 0.07, 0.09}};
constexpr Partial kFailure[] = {{262, 0.5, 0.06, 0}, {196, 0.5, 0.07, 0.09}};

struct Tone {
  std::span<const Partial> partials;
  double length_s;
};
/// Indexed by Sound.
constexpr std::array<Tone, kSounds> kTones{
    {{kContact, 0.07}, {kGrasp, 0.13}, {kRelease, 0.13}, {kGoal, 0.25}, {kFailure, 0.25}}};

double value_at(const Partial& partial, double t_s) {
  const double since_s = t_s - partial.start_s;
  if (since_s <= 0) return 0;
  const double attack = std::min(1.0, since_s / kAttack_s);
  return partial.gain * attack * std::exp(-since_s / partial.decay_s) *
         std::sin(2 * std::numbers::pi * partial.frequency_hz * since_s);
}

}  // namespace

std::vector<std::int16_t> samples_of(Sound sound, double gain) {
  const Tone& tone = kTones.at(static_cast<std::size_t>(sound));
  const double peak = kPeak * (std::isfinite(gain) ? std::clamp(gain, 0.0, 1.0) : 0.0);
  std::vector<std::int16_t> samples(static_cast<std::size_t>(tone.length_s * kSampleRate_hz));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t_s = static_cast<double>(i) / kSampleRate_hz;
    double value = 0;
    for (const Partial& partial : tone.partials) value += value_at(partial, t_s);
    const double end = std::min(1.0, (tone.length_s - t_s) / kEnd_s);
    samples[i] = static_cast<std::int16_t>(peak * end * std::clamp(value, -1.0, 1.0));
  }
  return samples;
}

}  // namespace tandem::client
