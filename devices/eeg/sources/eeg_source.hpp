// Interface of a source of EEG that is read while it is recorded.
#pragma once

#include <vector>

#include "common/base/time.hpp"
#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

class EegSource {
 public:
  virtual ~EegSource() = default;

  virtual const StreamFormat& format() const = 0;
  /// True if the samples arrive by themselves; false if they are read from memory, so that their number is the time.
  virtual bool is_live() const = 0;
  /// Waits for `wait` and appends the samples of that time: one value of each channel [µV], then those of the next
  /// sample. A lost sample is NaN. Returns false at the end of a recording.
  /// Fails   std::runtime_error: the source was lost; the message names the remedy
  virtual bool read(std::vector<double>& frames_uv, Duration wait) = 0;
};

}  // namespace tandem::eeg
