#include "devices/eeg/sources/recorded_source.hpp"

#include <algorithm>
#include <thread>

namespace tandem::eeg {

RecordedSource::RecordedSource(Recording recording, bool in_real_time)
    : recording_(std::move(recording)), in_real_time_(in_real_time) {}

bool RecordedSource::read(std::vector<double>& frames_uv, Duration wait) {
  if (in_real_time_) std::this_thread::sleep_for(wait);
  read_s_ += to_seconds(wait);
  const auto end = std::min(recording_.length(), static_cast<std::size_t>(read_s_ * recording_.format.rate_hz));
  for (; next_ < end; ++next_) {
    for (const std::vector<double>& channel : recording_.samples_uv) frames_uv.push_back(channel[next_]);
  }
  return next_ < recording_.length();
}

}  // namespace tandem::eeg
