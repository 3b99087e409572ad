// Replays a recording or generated EEG as an EegSource.
#pragma once

#include <cstddef>

#include "devices/eeg/sources/eeg_source.hpp"

namespace tandem::eeg {

class RecordedSource final : public EegSource {
 public:
  /// In      in_real_time  true: read() waits in real time; false: it returns at once
  RecordedSource(Recording recording, bool in_real_time);

  const StreamFormat& format() const override { return recording_.format; }
  bool is_live() const override { return false; }
  bool read(std::vector<double>& frames_uv, Duration wait) override;

 private:
  Recording recording_;
  bool in_real_time_;
  double read_s_ = 0;
  std::size_t next_ = 0;
};

}  // namespace tandem::eeg
