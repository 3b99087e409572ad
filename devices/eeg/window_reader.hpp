// Cuts a stream of EEG into windows, with the features and the artefacts of each.
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
  double low_hz = 2, high_hz = 42;  ///< edges of the band-pass, at -3 dB
  std::size_t window = 512;         ///< samples of a window
  std::size_t step = 512;           ///< samples from one window to the next
  ArtefactLimits limits;
};

/// Fails   std::invalid_argument: a number is out of its range; the message names the value
void check(const WindowSettings& settings);

struct Window {
  std::uint64_t first_sample = 0;
  std::vector<double> features;     ///< kFeatureCount for each channel, channel by channel
  std::vector<std::uint8_t> flags;  ///< bits of Artefact for each channel

  bool is_clean() const;
};

/// Filters each channel and evaluates it window by window.
///
/// Cost    a window: O(channels · window · kHiguchiMax)
class WindowReader {
 public:
  /// Fails   std::invalid_argument: the settings are not possible at the rate of the stream
  WindowReader(StreamFormat format, WindowSettings settings);

  /// Takes one sample of each channel [µV], NaN for a lost one. Returns true if a window is complete.
  bool append(std::span<const double> frame_uv);
  /// Begins a new window with the next sample. The filter keeps its state.
  void restart();
  /// Returns the window that append() has completed.
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

/// Number of windows with each artefact, for each channel.
class ArtefactCount {
 public:
  explicit ArtefactCount(std::vector<std::string> channels);

  void add(const Window& window);
  std::size_t windows() const { return windows_; }
  std::size_t flagged() const { return flagged_; }
  /// Returns a summary in lines: totals, and each channel with flags.
  std::string text() const;

 private:
  std::vector<std::string> channels_;
  std::vector<std::array<std::size_t, kArtefactNames.size()>> counts_;
  std::size_t windows_ = 0, flagged_ = 0;
};

}  // namespace tandem::eeg
