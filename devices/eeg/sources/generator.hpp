// Synthetic EEG of two states, for tests and for trying the program without a headset.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"
#include "devices/eeg/sources/edf_file.hpp"

namespace tandem::eeg {

/// Settings of synthetic EEG. The state modulates alpha and beta rhythms: in each window of `window` samples all channels share
/// a latent number z, normal with standard deviation 1 and mean ±Φ⁻¹(bayes_accuracy). The rhythms follow exp(±0.3 z).
/// No classifier of such windows is more accurate than `bayes_accuracy`; 0.5 is EEG without an effect.
struct GeneratorSettings {
  std::uint64_t seed = 1;
  std::uint64_t session = 0;  ///< another session of the same person has other noise
  double rate_hz = kDefaultRateHz;
  std::vector<std::string> channels = kDefaultChannels;
  std::size_t window = 512;
  std::size_t blocks = 20;            ///< blocks of alternating state, in random order of each pair
  std::size_t windows_per_block = 5;  ///< the state is constant in a block
  double bayes_accuracy = 0.9;
  double block_effect = 0;           ///< standard deviation of a shift of z that each block has, in either state
  double blinks_per_min = 0;         ///< on the two front channels
  double bad_contacts_per_hour = 0;  ///< each on a random channel, for 10 s: flat or hum
  std::string negative = "negative", positive = "positive";  ///< labels of the blocks
};

/// Fails   std::invalid_argument: a number is out of its range; the message names the option
void check(const GeneratorSettings& settings);

/// Generates a recording. The blocks are annotated with their labels, each blink with "blink" and each bad contact with
/// "bad contact CHANNEL".
Recording generate(const GeneratorSettings& settings);

/// Converts a recording to the integers of a file, clipped to the range of the format.
EdfContent edf_from(const Recording& recording, bool is_bdf);

/// Returns Φ⁻¹(p), the quantile of the standard normal distribution, for 0 < p < 1.
double normal_quantile(double p);

}  // namespace tandem::eeg
