// Generates synthetic EEG of a person in two states, for tests and for trials of the program without a headset.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"
#include "devices/eeg/sources/edf_file.hpp"

namespace tandem::eeg {

/// Settings of synthetic EEG. The state modulates the alpha and beta rhythms.
///
/// Model   z is a random number that all channels have in common during a window of `window` samples. It is normally
///         distributed with standard deviation 1. Its mean is Φ⁻¹(bayes_accuracy), with the sign of the state. The
///         amplitude of one rhythm is proportional to exp(0.3 z), that of the other to exp(−0.3 z). Consequence: no
///         classifier of such windows can be more accurate than `bayes_accuracy`. With the value 0.5, the state has no
///         effect.
struct GeneratorSettings {
  std::uint64_t seed = 1;
  std::uint64_t session = 0;  ///< number of the session; sessions with equal seed differ in their noise
  double rate_hz = kDefaultRateHz;
  std::vector<std::string> channels = kDefaultChannels;
  std::size_t window = 512;
  std::size_t blocks = 20;            ///< number of blocks; each pair of blocks has both states, in random order
  std::size_t windows_per_block = 5;  ///< length of a block, in which the state is constant
  double bayes_accuracy = 0.9;
  double block_effect = 0;           ///< standard deviation of an offset that each block adds to z at random
  double blinks_per_min = 0;         ///< mean rate of blinks, which are added to the first and the last channel
  double bad_contacts_per_hour = 0;  ///< mean rate of bad contacts: a random channel is flat or has hum for 10 s
  std::string negative = "negative", positive = "positive";  ///< labels of the blocks
};

/// Checks the settings.
/// Fails   std::invalid_argument: a number is out of its range; the message names the option
void check(const GeneratorSettings& settings);

/// Generates a recording. Its annotations mark each block by its label, each blink by "blink", and each bad contact by
/// "bad contact CHANNEL".
Recording generate(const GeneratorSettings& settings);

/// Converts a recording to the integers of an EDF+ or BDF+ file, clipped to the range of the format.
EdfContent edf_from(const Recording& recording, bool is_bdf);

/// Returns Φ⁻¹(p), the quantile of the standard normal distribution, for 0 < p < 1.
double normal_quantile(double p);

}  // namespace tandem::eeg
