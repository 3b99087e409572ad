#include "devices/eeg/sources/lsl_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "devices/eeg/sources/edf_file.hpp"
#include "devices/vendor_library.hpp"

namespace tandem::eeg {
namespace {

/// Functions of liblsl, which is loaded at run time. The declarations were written for this project from the public
/// documentation. Objects of the library are opaque pointers.
struct LslFunctions {
  std::int32_t (*resolve)(void** infos, std::uint32_t size, const char* property, const char* value,
                          std::int32_t minimum, double timeout_s);
  void* (*create_inlet)(void* info, std::int32_t buffer_s, std::int32_t chunk, std::int32_t recovers);
  void (*destroy_inlet)(void* inlet);
  void (*destroy_info)(void* info);
  void* (*full_info)(void* inlet, double timeout_s, std::int32_t* error);
  unsigned long (*pull_chunk)(void* inlet, double* data, double* times, unsigned long data_size,
                              unsigned long times_size, double timeout_s, std::int32_t* error);
  std::int32_t (*channel_count)(void* info);
  double (*nominal_rate)(void* info);
  const char* (*name)(void* info);
  void* (*description)(void* info);
  void* (*child)(void* element, const char* name);
  void* (*next_sibling)(void* element, const char* name);
  const char* (*child_value)(void* element, const char* name);
};

constexpr std::int32_t kLslLost = -2;

LslFunctions lsl_functions(const std::filesystem::path& library) {
  devices::VendorLibrary lsl("library liblsl of the lab streaming layer", library,
                             {"liblsl.so.2", "liblsl.so", "liblsl64.so"});
  LslFunctions found{};
  lsl.find(found.resolve, "lsl_resolve_byprop");
  lsl.find(found.create_inlet, "lsl_create_inlet");
  lsl.find(found.destroy_inlet, "lsl_destroy_inlet");
  lsl.find(found.destroy_info, "lsl_destroy_streaminfo");
  lsl.find(found.full_info, "lsl_get_fullinfo");
  lsl.find(found.pull_chunk, "lsl_pull_chunk_d");
  lsl.find(found.channel_count, "lsl_get_channel_count");
  lsl.find(found.nominal_rate, "lsl_get_nominal_srate");
  lsl.find(found.name, "lsl_get_name");
  lsl.find(found.description, "lsl_get_desc");
  lsl.find(found.child, "lsl_child");
  lsl.find(found.next_sibling, "lsl_next_sibling_n");
  lsl.find(found.child_value, "lsl_child_value_n");
  lsl.require_all();
  return found;
}

std::string text_from(const char* text) {
  return text != nullptr ? text : "";
}

class LslSource final : public EegSource {
 public:
  explicit LslSource(const LslSettings& settings) : settings_(settings), lsl_(lsl_functions(settings.library)) {
    open();
    last_sample_ = clock_.now();
  }
  ~LslSource() override {
    if (inlet_ != nullptr) lsl_.destroy_inlet(inlet_);
  }
  LslSource(const LslSource&) = delete;
  LslSource& operator=(const LslSource&) = delete;

  const StreamFormat& format() const override { return format_; }
  bool is_live() const override { return true; }
  bool read(std::vector<double>& frames_uv, Duration wait) override;

 private:
  void open();
  void read_description(void* info);
  void read_channel(void* channel, std::size_t index);

  LslSettings settings_;
  SteadyClock clock_;
  LslFunctions lsl_;
  void* inlet_ = nullptr;
  StreamFormat format_;
  std::vector<double> microvolts_;  ///< scale: microvolts per unit of each channel
  std::vector<double> buffer_;
  LocalTime last_sample_{};
};

void LslSource::open() {
  constexpr std::uint32_t kMaxStreams = 32;
  constexpr std::int32_t kBufferS = 60;
  void* infos[kMaxStreams] = {};
  const bool has_name = !settings_.stream.empty();
  const std::int32_t found =
      lsl_.resolve(infos, kMaxStreams, has_name ? "name" : "type", has_name ? settings_.stream.c_str() : "EEG", 1,
                   to_seconds(settings_.found_within));
  if (found < 1)
    throw std::runtime_error("LSL finds no stream " +
                             (has_name ? "named '" + settings_.stream + "'" : "of the type EEG") +
                             "; start the headset's LSL program in the same network, or name its stream by --stream");
  inlet_ = lsl_.create_inlet(infos[0], kBufferS, 0, 0);
  for (std::int32_t i = 0; i < std::min<std::int32_t>(found, kMaxStreams); ++i) lsl_.destroy_info(infos[i]);
  std::int32_t error = 0;
  void* const info = inlet_ != nullptr ? lsl_.full_info(inlet_, to_seconds(settings_.found_within), &error) : nullptr;
  if (info == nullptr || error != 0)
    throw std::runtime_error("the LSL stream was found, but does not send its description; restart its program");
  read_description(info);
  lsl_.destroy_info(info);
}

void LslSource::read_description(void* info) {
  const std::int32_t count = lsl_.channel_count(info);
  if (count < 1 || static_cast<std::size_t>(count) > kMaxChannels)
    throw std::runtime_error("LSL stream '" + text_from(lsl_.name(info)) + "' has " + std::to_string(count) +
                             " channels; 1 to " + std::to_string(kMaxChannels) + " are possible");
  format_.rate_hz = lsl_.nominal_rate(info);
  if (!(format_.rate_hz >= 1 && format_.rate_hz <= kMaxRateHz))
    throw std::runtime_error("LSL stream '" + text_from(lsl_.name(info)) +
                             "' has no constant rate from 1 to 20000 Hz; choose another by --stream");
  microvolts_.assign(static_cast<std::size_t>(count), 1);
  for (std::int32_t i = 0; i < count; ++i) format_.channels.push_back("channel " + std::to_string(i + 1));
  void* const channels = lsl_.child(lsl_.description(info), "channels");
  void* channel = channels != nullptr ? lsl_.child(channels, "channel") : nullptr;
  for (std::size_t i = 0; channel != nullptr && i < microvolts_.size(); ++i) {
    read_channel(channel, i);
    channel = lsl_.next_sibling(channel, "channel");
  }
}

void LslSource::read_channel(void* channel, std::size_t index) {
  const std::string label = text_from(lsl_.child_value(channel, "label"));
  const std::string unit = text_from(lsl_.child_value(channel, "unit"));
  if (!label.empty()) format_.channels[index] = label;
  if (unit.empty()) return;
  // Some LSL programs write the name of the unit in full.
  const double scale = unit == "microvolts" || unit == "microvolt" ? 1 : unit == "volts" ? 1e6 : microvolts_per(unit);
  if (scale == 0)
    throw std::runtime_error("LSL channel '" + label + "' has the unit '" + unit +
                             "'; EEG needs microvolts, uV, mV, nV or V");
  microvolts_[index] = scale;
}

bool LslSource::read(std::vector<double>& frames_uv, Duration wait) {
  constexpr double kMarginS = 0.5;
  const std::size_t channels = microvolts_.size();
  // The buffer holds more samples than arrive during `wait`. pull_chunk would return before `wait` has passed if the
  // buffer became full.
  buffer_.resize(channels * static_cast<std::size_t>(1 + format_.rate_hz * (to_seconds(wait) + kMarginS)));
  std::int32_t error = 0;
  const unsigned long pulled =
      lsl_.pull_chunk(inlet_, buffer_.data(), nullptr, buffer_.size(), 0, to_seconds(wait), &error);
  if (error == kLslLost) throw std::runtime_error("the LSL stream was lost; start the headset's LSL program again");
  if (error != 0) throw std::runtime_error("LSL reports error " + std::to_string(error) + "; start the program again");
  const std::size_t values = std::min<std::size_t>(pulled, buffer_.size()) / channels * channels;
  for (std::size_t i = 0; i < values; ++i) {
    const double uv = buffer_[i] * microvolts_[i % channels];
    frames_uv.push_back(std::isfinite(uv) ? uv : std::numeric_limits<double>::quiet_NaN());
  }
  if (values > 0) last_sample_ = clock_.now();
  if (clock_.now() - last_sample_ > settings_.silent_for)
    throw std::runtime_error("the LSL stream sends nothing; start the headset's LSL program again");
  return true;
}

}  // namespace

std::unique_ptr<EegSource> open_lsl(const LslSettings& settings) {
  return std::make_unique<LslSource>(settings);
}

}  // namespace tandem::eeg
