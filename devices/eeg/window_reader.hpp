// Cuts a stream of EEG into windows, and computes the features and artefacts of each window.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "devices/eeg/artefacts.hpp"
#include "devices/eeg/band_pass.hpp"
#include "devices/eeg/features.hpp"
#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

struct WindowSettings {
  double low_hz = 2, high_hz = 42;  ///< edges of the band-pass filter, at -3 dB
  std::size_t window = 512;         ///< length of a window [samples]
  std::size_t step = 512;           ///< samples from the start of one window to the start of the next
  ArtefactLimits limits;
};

/// Checks the settings.
/// Fails   std::invalid_argument: a number is out of its range; the message names the value
void check(const WindowSettings& settings);

struct Window {
  std::uint64_t first_sample = 0;
  std::vector<double> features;     ///< kFeatureCount values of the first channel, then of the next
  std::vector<std::uint8_t> flags;  ///< artefacts of each channel, as bits of Artefact

  bool is_clean() const;
};

/// Filters each channel, and computes its features and artefacts window by window.
///
/// Cost    for each window O(channels · window length · kHiguchiMax)
class WindowReader {
 public:
  /// Fails   std::invalid_argument: the settings are not possible at the rate of the stream
  WindowReader(StreamFormat format, WindowSettings settings);

  /// Accepts one sample of each channel [µV]; a lost sample is NaN. Returns whether a window is complete with this
  /// sample.
  bool append(std::span<const double> frame_uv);
  /// Discards the samples of the incomplete window, so that a new window begins with the next sample. The filter keeps
  /// its state.
  void restart();
  /// Returns the complete window. The last append() must have returned true.
  Window window() const;

 private:
  struct Channel {
    BandPass filter;
    std::vector<double> raw_uv, filtered_uv;
    double last_uv = 0;
  };

  StreamFormat format_;
  WindowSettings settings_;
  std::vector<Channel> channels_;
  std::uint64_t count_ = 0;
};

/// Returns all windows of a recording.
std::vector<Window> windows_of(const Recording& recording, const WindowSettings& settings);

/// Counts the windows with each artefact, for each channel.
class ArtefactCount {
 public:
  explicit ArtefactCount(std::vector<std::string> channels);

  void add(const Window& window);
  std::size_t windows() const { return windows_; }
  std::size_t flagged() const { return flagged_; }
  /// Returns a summary in lines: first the totals, then each channel that had artefacts.
  std::string text() const;

 private:
  std::vector<std::string> channels_;
  std::vector<std::array<std::size_t, kArtefactNames.size()>> counts_;
  std::size_t windows_ = 0, flagged_ = 0;
};

}  // namespace tandem::eeg
