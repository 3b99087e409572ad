// Reads arbitrary bytes as a message of the Cortex service (an EEG headset), and as the columns and a sample of its
// EEG.
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "devices/eeg/recording.hpp"
#include "devices/eeg/sources/cortex_messages.hpp"
#include "tests/fuzz/check.hpp"

using tandem::fuzz::check;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::eeg;
  constexpr std::size_t kMaxLost = 128;
  const auto message = read_cortex_message({reinterpret_cast<const char*>(data), size});
  if (!message) return 0;
  if (message->error) check(!cortex_advice(*message->error).empty());
  if (message->warning) cortex_loss(*message->warning);
  try {
    CortexColumns columns(message->result);
    const std::size_t channels = columns.electrodes().size();
    check(channels >= 1 && channels <= kMaxChannels);
    std::vector<double> frames;
    if (!message->eeg || !columns.append(*message->eeg, kMaxLost, frames)) return 0;
    check(frames.size() % channels == 0 && frames.size() / channels <= kMaxLost + 1);
    for (const double uv : frames) check(std::isfinite(uv) || std::isnan(uv));
  } catch (const std::runtime_error&) {
    return 0;
  }
  return 0;
}
