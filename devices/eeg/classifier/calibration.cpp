#include "devices/eeg/classifier/calibration.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "common/base/json_fields.hpp"

namespace tandem::eeg {
namespace {

constexpr double kSameBlockS = 1.0;
constexpr const char* kCopied = "; a copy on both sides of a validation makes it meaningless, name each session once";

std::optional<double> seconds_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  return is_number && std::isfinite(value) && value >= 0 ? std::optional(value) : std::nullopt;
}

/// Returns a hash of the samples from `begin` to `end`, in hexadecimal. Algorithm: FNV-1a, applied to 64-bit samples
/// instead of bytes.
std::string fingerprint_of(const Recording& recording, std::size_t begin, std::size_t end) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::vector<double>& channel : recording.samples_uv) {
    for (std::size_t n = begin; n < end; ++n) {
      hash ^= std::bit_cast<std::uint64_t>(channel[n]);
      hash *= 1099511628211ULL;
    }
  }
  std::ostringstream text;
  text << std::hex << hash;
  return text.str();
}

void check_format(const Calibration& calibration, const Recording& recording) {
  if (calibration.sessions.empty()) return;
  if (recording.format.channels != calibration.format.channels)
    throw std::invalid_argument(recording.origin + ": channels differ from those of " + calibration.sessions.front() +
                                "; choose the same ones by --channels");
  if (recording.format.rate_hz != calibration.format.rate_hz)
    throw std::invalid_argument(recording.origin + ": rate differs from that of " + calibration.sessions.front() +
                                "; sessions of one person must have one rate");
}

/// Refuses a session whose samples are a copy of an earlier session. It compares hashes of all samples of the sessions.
/// Hashes of blocks would not detect a copy whose labels begin and end at different times.
void check_copy(const Calibration& calibration, const Recording& recording, const std::string& fingerprint) {
  const auto known = std::ranges::find(calibration.session_fingerprints, fingerprint);
  if (known == calibration.session_fingerprints.end()) return;
  const auto index = static_cast<std::size_t>(known - calibration.session_fingerprints.begin());
  throw std::invalid_argument(recording.origin + ": has the same samples as " + calibration.sessions[index] + kCopied);
}

void check_overlap(const Recording& recording, const std::vector<Block>& blocks) {
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    if (blocks[i].begin_s >= blocks[i - 1].end_s - 1e-6) continue;
    std::ostringstream text;
    text << recording.origin << ": labels overlap at " << blocks[i].begin_s << " s; correct their durations";
    throw std::invalid_argument(text.str());
  }
}

/// A labelled block as a range of sample indices. `block` is its index in Calibration::blocks.
struct Span {
  std::size_t begin, end, block;
  bool is_positive;
};

Span add_block(Calibration& calibration, const Recording& recording, const Block& block) {
  const auto sample = [&](double time_s) {
    const double n = std::clamp(time_s * recording.format.rate_hz, 0.0, static_cast<double>(recording.length()));
    return static_cast<std::size_t>(std::llround(n));
  };
  const Span span{sample(block.begin_s), sample(block.end_s), calibration.blocks.size(), block.is_positive};
  const std::string print = fingerprint_of(recording, span.begin, span.end);
  for (const CalibrationBlock& known : calibration.blocks) {
    if (known.fingerprint != print || span.begin >= span.end) continue;
    throw std::invalid_argument(recording.origin + ": has the same samples as " + calibration.sessions[known.session] +
                                kCopied);
  }
  calibration.blocks.push_back({calibration.sessions.size(), block.is_positive, print});
  if (span.end - std::min(span.begin, span.end) < calibration.settings.window) ++calibration.too_short_blocks;
  return span;
}

}  // namespace

std::vector<Block> blocks_of(const Recording& recording, const Labels& labels) {
  if (labels.negative == labels.positive)
    throw std::invalid_argument("--labels: both labels are '" + labels.negative + "'; they must differ");
  std::vector<Annotation> labelled;
  for (const Annotation& one : recording.annotations) {
    if (one.text == labels.negative || one.text == labels.positive) labelled.push_back(one);
  }
  if (labelled.empty())
    throw std::invalid_argument(recording.origin + ": no annotation is '" + labels.negative + "' or '" +
                                labels.positive + "'; name the texts by --labels, or give --label-files");
  std::ranges::stable_sort(labelled, {}, &Annotation::onset_s);
  const double length_s = static_cast<double>(recording.length()) / recording.format.rate_hz;
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < labelled.size(); ++i) {
    const double next_s = i + 1 < labelled.size() ? labelled[i + 1].onset_s : length_s;
    const double end_s = labelled[i].duration_s ? labelled[i].onset_s + *labelled[i].duration_s : next_s;
    const Block block{labelled[i].onset_s, end_s, labelled[i].text == labels.positive};
    const bool continues = !blocks.empty() && blocks.back().is_positive == block.is_positive &&
                           std::abs(block.begin_s - blocks.back().end_s) <= kSameBlockS;
    if (continues)
      blocks.back().end_s = block.end_s;
    else
      blocks.push_back(block);
  }
  check_overlap(recording, blocks);
  return blocks;
}

std::vector<Annotation> read_label_file(const std::filesystem::path& file) {
  std::istringstream in(read_text_file(file));
  std::vector<Annotation> annotations;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with("onset_s,")) continue;
    const std::size_t first = line.find(','), second = line.find(',', first == std::string::npos ? first : first + 1);
    const bool has_three = second != std::string::npos;
    const auto onset_s = has_three ? seconds_in(line.substr(0, first)) : std::nullopt;
    const std::string middle = has_three ? line.substr(first + 1, second - first - 1) : "";
    const auto duration_s = seconds_in(middle);
    if (!onset_s || (!middle.empty() && !duration_s))
      throw std::invalid_argument(
          file.string() + ":" + std::to_string(number) +
          ": must be onset_s,duration_s,label with times in seconds, for example 12.5,20,positive");
    annotations.push_back({*onset_s, duration_s, line.substr(second + 1)});
  }
  return annotations;
}

std::vector<bool> blocks_with_windows(const Calibration& calibration) {
  std::vector<bool> has_windows(calibration.blocks.size());
  for (const LabelledWindow& one : calibration.windows) has_windows[one.block] = true;
  return has_windows;
}

void add_session(Calibration& calibration, const Recording& recording) {
  check_format(calibration, recording);
  const std::string fingerprint = fingerprint_of(recording, 0, recording.length());
  check_copy(calibration, recording, fingerprint);
  calibration.format = recording.format;
  std::vector<Span> spans;
  for (const Block& block : blocks_of(recording, calibration.labels))
    spans.push_back(add_block(calibration, recording, block));
  std::erase_if(spans, [](const Span& one) { return one.begin >= one.end; });
  WindowReader reader(recording.format, calibration.settings);
  ArtefactCount& count = calibration.artefacts.emplace_back(recording.format.channels);
  std::vector<double> frame(recording.samples_uv.size());
  auto span = spans.begin();
  for (std::size_t n = 0; n < recording.length() && span != spans.end(); ++n) {
    if (n == span->begin) reader.restart();
    for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = recording.samples_uv[i][n];
    const bool is_complete = reader.append(frame) && n >= span->begin + calibration.settings.window - 1;
    if (is_complete && n < span->end) {
      Window window = reader.window();
      count.add(window);
      if (window.is_clean())
        calibration.windows.push_back({std::move(window.features), span->is_positive, span->block});
    }
    if (n + 1 >= span->end) ++span;
  }
  calibration.sessions.push_back(recording.origin);
  calibration.session_fingerprints.push_back(fingerprint);
}

}  // namespace tandem::eeg
