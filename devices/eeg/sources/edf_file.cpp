#include "devices/eeg/sources/edf_file.hpp"

#include <edflib.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "devices/eeg/sources/edf_header.hpp"

namespace tandem::eeg {
namespace {

/// Units of time in EDFlib, as ticks per second: 100 ns in general, but 100 µs when annotations are written.
constexpr double kTicksPerS = EDFLIB_TIME_DIMENSION;
constexpr double kWriteTicksPerS = 1e4;
constexpr std::int64_t kMaxAnnotations = 1'000'000;

/// Owns an open file of EDFlib, and closes it on destruction.
class Handle {
 public:
  explicit Handle(int handle) : handle_(handle) {}
  ~Handle() {
    if (handle_ >= 0) edfclose_file(handle_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  int get() const { return handle_; }
  /// Closes the file. Returns whether it was written completely.
  bool close() { return edfclose_file(std::exchange(handle_, -1)) == 0; }

 private:
  int handle_;
};

std::string trimmed_text(const char* text) {
  const std::string all(text);
  const std::size_t begin = all.find_first_not_of(' ');
  return begin == std::string::npos ? "" : all.substr(begin, all.find_last_not_of(' ') - begin + 1);
}

std::string refusal(int reason) {
  switch (reason) {
    case EDFLIB_FILE_IS_DISCONTINUOUS:
      return "field reserved announces an interrupted recording; export it as a continuous one";
    case EDFLIB_FILE_CONTAINS_FORMAT_ERRORS:
      return "fields patient, recording, startdate or starttime, or an annotation, break the format EDF+ or BDF+; "
             "export the recording again";
    case EDFLIB_MALLOC_ERROR:
      return "there is not enough memory to read it";
    default:
      return "it cannot be read (EDFlib: " + std::to_string(reason) + "); check its permissions";
  }
}

EdfSignal read_signal(const std::filesystem::path& file, int handle, int index, const edf_param_struct& header) {
  EdfSignal signal{.name = trimmed_text(header.label),
                   .unit = trimmed_text(header.physdimension),
                   .samples_per_record = header.smp_in_datarecord,
                   .digital_min = header.dig_min,
                   .digital_max = header.dig_max,
                   .physical_min = header.phys_min,
                   .physical_max = header.phys_max,
                   .digital = {}};
  if (header.smp_in_file < 0 || static_cast<std::uint64_t>(header.smp_in_file) > kMaxFileSamples)
    throw std::invalid_argument(file.string() + ": " + signal.name + ": number of samples is out of range");
  signal.digital.resize(static_cast<std::size_t>(header.smp_in_file));
  const auto count = static_cast<int>(signal.digital.size());
  if (edfread_digital_samples(handle, index, count, signal.digital.data()) != count)
    throw std::invalid_argument(file.string() + ": " + signal.name + ": samples end early; the file is damaged");
  return signal;
}

std::vector<Annotation> read_annotations(int handle, std::int64_t count) {
  std::vector<Annotation> annotations;
  edf_annotation_struct one{};
  for (int i = 0; i < std::min(count, kMaxAnnotations); ++i) {
    if (edf_get_annotation(handle, i, &one) != 0) continue;
    Annotation annotation{static_cast<double>(one.onset) / kTicksPerS, std::nullopt, one.annotation};
    if (one.duration_l >= 0) annotation.duration_s = static_cast<double>(one.duration_l) / kTicksPerS;
    annotations.push_back(std::move(annotation));
  }
  return annotations;
}

void check_written(const std::filesystem::path& file, const EdfContent& content) {
  const auto records_of = [](const EdfSignal& one) {
    return one.digital.size() / static_cast<std::size_t>(std::max(one.samples_per_record, 1));
  };
  for (const EdfSignal& one : content.signals) {
    if (one.samples_per_record < 1 || one.digital.size() % static_cast<std::size_t>(one.samples_per_record) != 0 ||
        records_of(one) != records_of(content.signals.front()) || one.digital.empty())
      throw std::invalid_argument(file.string() + ": " + one.name + ": does not fill the same whole records as others");
  }
}

void describe(int handle, const EdfContent& content) {
  int failures = 0;
  for (int i = 0; i < static_cast<int>(content.signals.size()); ++i) {
    const EdfSignal& one = content.signals[static_cast<std::size_t>(i)];
    failures += edf_set_samplefrequency(handle, i, one.samples_per_record);
    failures += edf_set_physical_maximum(handle, i, one.physical_max);
    failures += edf_set_physical_minimum(handle, i, one.physical_min);
    failures += edf_set_digital_maximum(handle, i, one.digital_max);
    failures += edf_set_digital_minimum(handle, i, one.digital_min);
    failures += edf_set_label(handle, i, one.name.c_str());
    failures += edf_set_physical_dimension(handle, i, one.unit.c_str());
  }
  // EDFlib would write the current date, from which a session could be identified. The earliest date that the format
  // allows is written instead.
  failures += edf_set_startdatetime(handle, 1985, 1, 1, 0, 0, 0);
  const auto first = content.signals.front();
  const std::size_t records = first.digital.size() / static_cast<std::size_t>(first.samples_per_record);
  constexpr std::size_t kMaxAnnotationSignals = 64;
  const std::size_t needed = (content.annotations.size() + records - 1) / records;
  failures += edf_set_number_of_annotation_signals(
      handle, static_cast<int>(std::clamp<std::size_t>(needed, 1, kMaxAnnotationSignals)));
  if (content.record_s != 1)
    failures += edf_set_datarecord_duration(handle, static_cast<int>(std::lround(content.record_s * 1e5)));
  if (failures != 0) throw std::invalid_argument("a name, a range or a rate does not fit the format");
}

void write_samples(int handle, const EdfContent& content) {
  const auto& first = content.signals.front();
  const std::size_t records = first.digital.size() / static_cast<std::size_t>(first.samples_per_record);
  std::vector<int> record;
  for (std::size_t r = 0; r < records; ++r) {
    for (const EdfSignal& one : content.signals) {
      const auto size = static_cast<std::ptrdiff_t>(one.samples_per_record);
      const auto begin = one.digital.begin() + static_cast<std::ptrdiff_t>(r) * size;
      record.assign(begin, begin + size);
      if (edfwrite_digital_samples(handle, record.data()) != 0)
        throw std::invalid_argument("writing failed; is the disk full?");
    }
  }
  for (const Annotation& one : content.annotations) {
    const long long onset = std::llround(one.onset_s * kWriteTicksPerS);
    const long long duration = one.duration_s ? std::llround(*one.duration_s * kWriteTicksPerS) : -1;
    if (edfwrite_annotation_utf8(handle, onset, duration, one.text.c_str()) != 0)
      throw std::invalid_argument("annotation '" + one.text + "' cannot be written");
  }
}

/// Returns the name of an electrode, which is an EDF+ label without the type of the signal ("F3" for "EEG F3").
std::string electrode(const std::string& label) {
  constexpr std::string_view kType = "EEG ";
  return label.starts_with(kType) ? label.substr(kType.size()) : label;
}

std::vector<const EdfSignal*> chosen(const std::string& origin, const EdfContent& content,
                                     const std::vector<std::string>& channels) {
  std::vector<const EdfSignal*> signals;
  std::string available;
  for (const EdfSignal& one : content.signals) {
    available += (available.empty() ? "" : ", ") + electrode(one.name) + " [" + one.unit + "]";
    if (channels.empty() && microvolts_per(one.unit) > 0) signals.push_back(&one);
  }
  for (const std::string& name : channels) {
    const auto found = std::ranges::find_if(
        content.signals, [&](const EdfSignal& one) { return electrode(one.name) == name || one.name == name; });
    if (found == content.signals.end())
      throw std::invalid_argument(origin + ": has no channel '" + name + "'; it has " + available);
    if (microvolts_per(found->unit) == 0)
      throw std::invalid_argument(origin + ": unit of channel '" + name + "' is '" + found->unit +
                                  "'; EEG needs uV, mV, nV or V");
    signals.push_back(&*found);
  }
  if (signals.empty())
    throw std::invalid_argument(origin + ": no channel has the unit uV, mV, nV or V; it has " + available);
  if (signals.size() > kMaxChannels)
    throw std::invalid_argument(origin + ": has " + std::to_string(signals.size()) + " channels, at most " +
                                std::to_string(kMaxChannels) + " are used; choose them by --channels");
  return signals;
}

double range_uv(const EdfSignal& signal, std::int32_t value) {
  return signal.physical(value) * microvolts_per(signal.unit);
}

}  // namespace

double EdfSignal::physical(std::int32_t value) const {
  const double step = (physical_max - physical_min) / (static_cast<double>(digital_max) - digital_min);
  return physical_min + (static_cast<double>(value) - digital_min) * step;
}

double microvolts_per(const std::string& unit) {
  if (unit == "uV" || unit == "\xc2\xb5V" || unit == "\xb5V") return 1;
  if (unit == "mV") return 1e3;
  if (unit == "nV") return 1e-3;
  return unit == "V" ? 1e6 : 0;
}

EdfContent read_edf(const std::filesystem::path& file) {
  check_edf_header(file);
  const auto header = std::make_unique<edf_hdr_struct>();
  if (edfopen_file_readonly(file.c_str(), header.get(), EDFLIB_READ_ALL_ANNOTATIONS) != 0)
    throw std::invalid_argument(file.string() + ": " + refusal(header->filetype));
  const Handle handle(header->handle);
  EdfContent content;
  content.is_bdf = header->filetype == EDFLIB_FILETYPE_BDF || header->filetype == EDFLIB_FILETYPE_BDFPLUS;
  content.record_s = static_cast<double>(header->datarecord_duration) / kTicksPerS;
  for (int i = 0; i < header->edfsignals; ++i)
    content.signals.push_back(read_signal(file, handle.get(), i, header->signalparam[i]));
  content.annotations = read_annotations(handle.get(), header->annotations_in_file);
  return content;
}

void write_edf(const std::filesystem::path& file, const EdfContent& content) {
  if (content.signals.empty()) throw std::invalid_argument(file.string() + ": nothing to write");
  check_written(file, content);
  if (std::filesystem::exists(file))
    throw std::invalid_argument(file.string() + ": exists already; remove it or name another file");
  Handle handle(edfopen_file_writeonly(file.c_str(), content.is_bdf ? EDFLIB_FILETYPE_BDFPLUS : EDFLIB_FILETYPE_EDFPLUS,
                                       static_cast<int>(content.signals.size())));
  if (handle.get() < 0)
    throw std::invalid_argument(file.string() + ": cannot be written; check its folder and its permissions");
  try {
    describe(handle.get(), content);
    write_samples(handle.get(), content);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(file.string() + ": " + error.what());
  }
  if (!handle.close()) throw std::invalid_argument(file.string() + ": writing failed; is the disk full?");
}

Recording read_recording(const std::filesystem::path& file, const std::vector<std::string>& channels) {
  const EdfContent content = read_edf(file);
  Recording recording{.origin = file.string(), .format = {}, .samples_uv = {}, .annotations = content.annotations};
  const auto signals = chosen(recording.origin, content, channels);
  const int per_record = signals.front()->samples_per_record;
  recording.format.rate_hz = per_record / content.record_s;
  if (!(recording.format.rate_hz <= kMaxRateHz))
    throw std::invalid_argument(recording.origin + ": rate is above 20000 Hz; resample the recording");
  for (const EdfSignal* one : signals) {
    if (one->samples_per_record != per_record)
      throw std::invalid_argument(recording.origin + ": channels " + electrode(signals.front()->name) + " and " +
                                  electrode(one->name) +
                                  " have different rates; choose channels of one rate by --channels");
    recording.format.channels.push_back(electrode(one->name));
    const double low_uv = range_uv(*one, one->digital_min), high_uv = range_uv(*one, one->digital_max);
    recording.format.ranges.push_back({std::min(low_uv, high_uv), std::max(low_uv, high_uv)});
    std::vector<double>& samples = recording.samples_uv.emplace_back();
    samples.reserve(one->digital.size());
    for (const std::int32_t value : one->digital) samples.push_back(range_uv(*one, value));
  }
  return recording;
}

}  // namespace tandem::eeg
