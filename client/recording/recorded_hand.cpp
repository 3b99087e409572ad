#include "client/recording/recorded_hand.hpp"

#include <stdexcept>

#include "client/recording/tick_codec.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"

namespace tandem::client {
namespace {

/// Limit of samples: more than half an hour at 1 kHz, in 0.4 GB of memory.
constexpr std::size_t kMaxSamples = 2'000'000;

}  // namespace

std::shared_ptr<const std::vector<devices::DeviceSample>> read_recorded_hand(const std::filesystem::path& file,
                                                                             std::string& why) {
  auto samples = std::make_shared<std::vector<devices::DeviceSample>>();
  const proto::RecordingEnd end =
      proto::read_recording(file, [&](const std::string& topic, const recording::Message& message) {
        if (topic != "/tick") return true;
        wire::RecordedTick tick;
        proto::require_recorded(message, tick);
        devices::DeviceSample sample = tick_of(tick).sample;
        sample.taken = LocalTime(Duration(static_cast<Duration::rep>(tick.at_ns())));
        samples->push_back(sample);
        if (samples->size() <= kMaxSamples) return true;
        throw std::invalid_argument(file.string() +
                                    " has more than 2 million ticks; name a part of it, e.g. FILE-002.mcap");
      });
  if (samples->empty()) {
    throw std::invalid_argument(file.string() + " has no ticks of a hand; name a recording of tandem-client --record");
  }
  if (end.is_damaged)
    samples->back().reason = "the recording is damaged or cut here; the warning at the start gives the place";
  why = end.why;
  return samples;
}

}  // namespace tandem::client
