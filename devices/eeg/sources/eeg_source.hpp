// Interface of a source of EEG samples: a headset that is recording, or a recording that is replayed.
#pragma once

#include <vector>

#include "common/base/time.hpp"
#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

class EegSource {
 public:
  virtual ~EegSource() = default;

  virtual const StreamFormat& format() const = 0;
  /// Returns true for a headset, whose samples arrive in real time. Returns false for a recording in memory, where the
  /// time is the number of samples divided by the rate.
  virtual bool is_live() const = 0;
  /// Waits for the duration `wait` (a replay may return at once). Then appends the samples of this interval, each with
  /// one value per channel [µV]; a lost sample is NaN. Returns false at the end of a recording.
  /// Fails   std::runtime_error: the source is lost; the message names the remedy
  virtual bool read(std::vector<double>& frames_uv, Duration wait) = 0;
};

}  // namespace tandem::eeg
