// Types of a recording of EEG: named channels with a common sampling rate, in microvolts.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tandem::eeg {

/// Default channels: those of a headset with 14 electrodes, with the names of the international 10-20 system.
inline const std::vector<std::string> kDefaultChannels{"AF3", "F7", "F3", "FC5", "T7", "P7", "O1",
                                                       "O2",  "P8", "T8", "FC6", "F4", "F8", "AF4"};
inline constexpr double kDefaultRateHz = 128;
/// Limits for every source, so that hostile data cannot make the program allocate without bound.
inline constexpr std::size_t kMaxChannels = 256;
inline constexpr double kMaxRateHz = 20'000;

/// Input range of the analog-to-digital converter of a channel [µV]. Values at its ends are counted as clipped.
struct ConverterRange {
  double low_uv;
  double high_uv;
};

struct StreamFormat {
  std::vector<std::string> channels;
  double rate_hz = 0;                  ///< sampling rate, equal for all channels
  std::vector<ConverterRange> ranges;  ///< range of each channel; empty if the source does not state the ranges
};

/// A text that marks a time of a recording. Times are relative to the first sample.
struct Annotation {
  double onset_s = 0;
  std::optional<double> duration_s;
  std::string text;
};

struct Recording {
  std::string origin;  ///< file name, for messages
  StreamFormat format;
  std::vector<std::vector<double>> samples_uv;  ///< samples, with the indices [channel][sample]
  std::vector<Annotation> annotations;

  std::size_t length() const { return samples_uv.empty() ? 0 : samples_uv.front().size(); }
};

}  // namespace tandem::eeg
