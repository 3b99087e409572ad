// Falsifications of the states of a recorded session before a client receives them: the input of client_stages_fuzz.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tests/fuzz/seed_file.hpp"

namespace tandem::fuzz {

/// One action. Unknown kinds are treated as kTrue.
enum class TimelineAct : std::uint8_t {
  kTrue,      ///< delivers the next recorded states, 1 ms apart, with their true times
  kSilence,   ///< delivers no state for a number of milliseconds
  kSpoilt,    ///< delivers the next recorded state with some numbers replaced
  kCrowd,     ///< like kSpoilt, with up to the maximum number of bodies and users
  kSequence,  ///< advances the sequence numbers of the following datagrams
  kStall,     ///< stalls the client for some time
  kOffset,    ///< advances the server's clock for all later states
  kStage,     ///< selects another stage or predictor
};

/// Reads bytes as numbers of any magnitude. After the end of the input it reads zeros.
class TimelineReader {
 public:
  explicit TimelineReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool is_done() const { return bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }
  /// Returns a number from 0 to 2^63 on a logarithmic scale. One byte is the exponent; a second byte has the binary
  /// digits after the leading one.
  std::uint64_t whole() {
    const unsigned exponent = byte() % 64U;
    const std::uint64_t digits = byte();
    return exponent < 8 ? digits >> (8 - exponent) : (256 + digits) << (exponent - 8) & ~(std::uint64_t{1} << 63U);
  }
  /// Returns a number from −2^63 to 2^63, with either sign and a magnitude on a logarithmic scale.
  std::int64_t number() {
    const bool is_negative = byte() % 2 == 1;
    const auto size = static_cast<std::int64_t>(whole());
    return is_negative ? -size : size;
  }
  /// Returns a number from −1 to 1 with uniform steps.
  double share() { return (static_cast<double>(byte()) - 127.5) / 127.5; }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Writes the seeds for each stage, by its number below `stages`. The seeds are timelines: one with true states only,
/// one with a silence, one for each number of a state that can be replaced, and one for each other action.
inline void write_timeline_seeds(const std::filesystem::path& folder, std::size_t stages = 8) {
  const auto act = [](TimelineAct kind) { return static_cast<std::uint8_t>(kind); };
  const auto write = [&folder](std::size_t stage, const std::string& name, std::vector<std::uint8_t> bytes) {
    bytes.insert(bytes.begin(), static_cast<std::uint8_t>(stage));
    write_seed(folder / (std::to_string(stage) + "_" + name), std::as_bytes(std::span(bytes)));
  };
  // Exponent of one year, which is 2^54.8 ns.
  constexpr std::uint8_t kYear = 54;
  for (std::size_t stage = 0; stage < stages; ++stage) {
    write(stage, "true", {act(TimelineAct::kTrue), 60});
    write(stage, "silence",
          {act(TimelineAct::kTrue), 40, act(TimelineAct::kSilence), 250, act(TimelineAct::kTrue), 40});
    for (std::uint8_t field = 0; field < 8; ++field) {
      const auto mask = static_cast<std::uint8_t>(1U << field);
      write(stage, "spoilt_" + std::to_string(field),
            {act(TimelineAct::kTrue), 30, act(TimelineAct::kSpoilt), mask, 0, 0, kYear, 255, act(TimelineAct::kTrue),
             30, act(TimelineAct::kSpoilt), 0, mask, 1, kYear, 255, act(TimelineAct::kSilence), 200});
    }
    // Sets all times of a state a year ahead. The state echoes no input, so that the client cannot correct its clock
    // offset by it.
    constexpr std::uint8_t kAheadWithoutEcho = 1U << 7U | 1U << 3U;
    write(stage, "ahead",
          {act(TimelineAct::kTrue), 30, act(TimelineAct::kSpoilt), kAheadWithoutEcho, 0, 0, 0, 0, kYear, 255,
           act(TimelineAct::kTrue), 30, act(TimelineAct::kSilence), 200});
    write(stage, "crowd",
          {act(TimelineAct::kTrue), 30, act(TimelineAct::kCrowd), 64, 16, 1, act(TimelineAct::kTrue), 30});
    write(stage, "sequence", {act(TimelineAct::kSequence), 20, 0, act(TimelineAct::kTrue), 20});
    write(stage, "stall", {act(TimelineAct::kTrue), 30, act(TimelineAct::kStall), 100, act(TimelineAct::kTrue), 30});
    write(stage, "offset",
          {act(TimelineAct::kTrue), 30, act(TimelineAct::kOffset), 0, kYear, 255, act(TimelineAct::kTrue), 60,
           act(TimelineAct::kOffset), 1, kYear, 255, act(TimelineAct::kTrue), 60});
    write(stage, "stage", {act(TimelineAct::kTrue), 30, act(TimelineAct::kStage), 1, 2, act(TimelineAct::kTrue), 60});
  }
}

}  // namespace tandem::fuzz
