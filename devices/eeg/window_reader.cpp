#include "devices/eeg/window_reader.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace tandem::eeg {
namespace {

/// Allowed window lengths [samples]. The maximum keeps a model file from making the program allocate without bound.
constexpr std::size_t kMinWindow = 64, kMaxWindow = 1U << 16U;

}  // namespace

void check(const WindowSettings& settings) {
  std::ostringstream text;
  if (settings.window < kMinWindow || settings.window > kMaxWindow) {
    text << "a window of " << settings.window << " samples is not possible; it must have " << kMinWindow << " to "
         << kMaxWindow;
    throw std::invalid_argument(text.str());
  }
  if (settings.step < 1 || settings.step > settings.window) {
    text << "a step of " << settings.step << " samples is not possible; it must be 1 to the window's "
         << settings.window;
    throw std::invalid_argument(text.str());
  }
}

bool Window::is_clean() const {
  return std::ranges::all_of(flags, [](std::uint8_t bits) { return bits == 0; });
}

WindowReader::WindowReader(StreamFormat format, WindowSettings settings)
    : format_(std::move(format)), settings_(settings) {
  check(settings_);
  const BandPass filter(settings_.low_hz, settings_.high_hz, format_.rate_hz);
  channels_.assign(format_.channels.size(), Channel{filter, {}, {}});
  for (Channel& channel : channels_) {
    channel.raw_uv.reserve(settings_.window);
    channel.filtered_uv.reserve(settings_.window);
  }
}

bool WindowReader::append(std::span<const double> frame_uv) {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    if (channel.raw_uv.size() == settings_.window) {
      const auto kept = static_cast<std::ptrdiff_t>(settings_.step);
      channel.raw_uv.erase(channel.raw_uv.begin(), channel.raw_uv.begin() + kept);
      channel.filtered_uv.erase(channel.filtered_uv.begin(), channel.filtered_uv.begin() + kept);
    }
    // A NaN would make the state of the filter NaN forever. A lost sample is therefore replaced by the last valid one.
    if (std::isfinite(frame_uv[i])) channel.last_uv = frame_uv[i];
    channel.raw_uv.push_back(frame_uv[i]);
    channel.filtered_uv.push_back(channel.filter.step(channel.last_uv));
  }
  ++count_;
  return !channels_.empty() && channels_.front().raw_uv.size() == settings_.window;
}

void WindowReader::restart() {
  for (Channel& channel : channels_) {
    channel.raw_uv.clear();
    channel.filtered_uv.clear();
  }
}

Window WindowReader::window() const {
  Window result;
  result.first_sample = count_ - settings_.window;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = channels_[i];
    const auto features = features_of(channel.filtered_uv);
    result.features.insert(result.features.end(), features.begin(), features.end());
    const auto range = format_.ranges.empty() ? std::nullopt : std::optional(format_.ranges[i]);
    result.flags.push_back(artefacts_in(channel.raw_uv, channel.filtered_uv, format_.rate_hz, range, settings_.limits));
  }
  return result;
}

std::vector<Window> windows_of(const Recording& recording, const WindowSettings& settings) {
  WindowReader reader(recording.format, settings);
  std::vector<Window> windows;
  std::vector<double> frame(recording.samples_uv.size());
  for (std::size_t n = 0; n < recording.length(); ++n) {
    for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = recording.samples_uv[i][n];
    if (reader.append(frame)) windows.push_back(reader.window());
  }
  return windows;
}

ArtefactCount::ArtefactCount(std::vector<std::string> channels)
    : channels_(std::move(channels)), counts_(channels_.size()) {}

void ArtefactCount::add(const Window& window) {
  ++windows_;
  if (!window.is_clean()) ++flagged_;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    for (std::size_t bit = 0; bit < counts_[i].size(); ++bit) counts_[i][bit] += (window.flags[i] >> bit) & 1U;
  }
}

std::string ArtefactCount::text() const {
  std::ostringstream text;
  text << windows_ << " windows, " << flagged_ << " of them with artefacts and not used\n";
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    std::ostringstream line;
    for (std::size_t bit = 0; bit < counts_[i].size(); ++bit) {
      if (counts_[i][bit] > 0) line << ' ' << kArtefactNames[bit] << ' ' << counts_[i][bit];
    }
    if (!line.str().empty()) text << "  " << channels_[i] << ':' << line.str() << '\n';
  }
  return text.str();
}

}  // namespace tandem::eeg
