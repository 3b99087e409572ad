#include "devices/eeg/classifier/signal.hpp"

#include <ostream>

#include "common/base/json_pretty.hpp"

namespace tandem::eeg {

void JsonLineSink::send(const SignalReport& report) {
  boost::json::object line{{"signal", report.name}, {"time_s", to_seconds(report.time.time_since_epoch())}};
  line["value"] = report.value ? boost::json::value(*report.value) : boost::json::value(nullptr);
  line["confidence"] = report.confidence;
  line["age_s"] = report.value ? boost::json::value(to_seconds(report.age)) : boost::json::value(nullptr);
  if (!report.artefacts.empty()) line["artefacts"] = report.artefacts;
  out_ << compact_json(line) << std::endl;
}

ValenceSignal::ValenceSignal(Model model, const StreamFormat& format, const std::string& origin)
    : model_(std::move(model)), reader_(format, model_.settings), count_(format.channels) {
  check_source(model_, format, origin);
}

void ValenceSignal::append(std::span<const double> frame_uv, LocalTime time) {
  if (!reader_.append(frame_uv)) return;
  const Window window = reader_.window();
  count_.add(window);
  newest_artefacts_.clear();
  for (std::size_t i = 0; i < window.flags.size(); ++i) {
    if (window.flags[i] == 0) continue;
    newest_artefacts_ +=
        (newest_artefacts_.empty() ? "" : ", ") + model_.format.channels[i] + " " + artefact_text(window.flags[i]);
  }
  if (!window.is_clean()) return;
  valence_ = model_.valence(window.features);
  evaluated_ = time;
}

void ValenceSignal::append_all(std::span<const double> frames_uv, LocalTime end) {
  const std::size_t channels = model_.format.channels.size(), frames = frames_uv.size() / channels;
  for (std::size_t i = 0; i < frames; ++i) {
    const double before_end_s = static_cast<double>(frames - 1 - i) / model_.format.rate_hz;
    append(frames_uv.subspan(i * channels, channels), end - from_seconds(before_end_s));
  }
}

SignalReport ValenceSignal::report(LocalTime now) const {
  SignalReport report{
      .name = "valence", .time = now, .value = {}, .confidence = 0, .age = {}, .artefacts = newest_artefacts_};
  if (!valence_) return report;
  report.value = valence_->value;
  report.confidence = valence_->confidence;
  report.age = now - evaluated_;
  return report;
}

}  // namespace tandem::eeg
