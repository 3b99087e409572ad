#include "devices/eeg/sources/edf_header.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tandem::eeg {
namespace {

constexpr std::size_t kBlock = 256;  ///< size [bytes] of the fixed part of the header, and of each signal's part
constexpr std::size_t kMaxSignals = 640;
constexpr std::uint64_t kMaxRecordBytes = 15'000'000;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c < 0x7f; });
}

/// Returns a text that is safe for a terminal: trimmed, with each unprintable byte replaced by a question mark.
std::string shown(std::string_view text) {
  std::string result(trimmed(text));
  std::ranges::replace_if(
      result, [](unsigned char c) { return c < 0x20 || c >= 0x7f; }, '?');
  return result;
}

std::optional<double> number_in(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// The header of a file, and the checks of its fields.
class Header {
 public:
  explicit Header(const std::filesystem::path& file);
  void check();

 private:
  [[noreturn]] void fail(const std::string& field, std::string_view value, const std::string& remedy) const;
  std::string_view text(std::size_t offset, std::size_t size) const {
    return std::string_view(bytes_).substr(offset, size);
  }
  std::string_view of_signal(std::size_t signal, std::size_t offset, std::size_t size) const {
    return text(kBlock + signals_ * offset + signal * size, size);
  }
  double whole(const std::string& field, std::string_view value, double low, double high) const;
  void read_kind();
  void check_fixed_part();
  void check_signal(std::size_t signal);
  void check_ranges(std::size_t signal, const std::string& name) const;
  void check_size() const;

  std::filesystem::path file_;
  std::uint64_t file_size_ = 0;
  std::string bytes_;
  bool is_bdf_ = false;
  std::size_t signals_ = 0;
  std::uint64_t records_ = 0;
  std::uint64_t record_samples_ = 0;
};

Header::Header(const std::filesystem::path& file) : file_(file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw std::invalid_argument(file.string() + ": is no file; name a recording in EDF+ or BDF+");
  file_size_ = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  bytes_.resize(std::min<std::uint64_t>(file_size_, kBlock * (1 + kMaxSignals)));
  in.read(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  if (!in) throw std::invalid_argument(file.string() + ": cannot be read; check its permissions");
}

void Header::fail(const std::string& field, std::string_view value, const std::string& remedy) const {
  throw std::invalid_argument(file_.string() + ": " + field + " is '" + shown(value) + "'; " + remedy);
}

double Header::whole(const std::string& field, std::string_view value, double low, double high) const {
  const auto number = number_in(value);
  if (!number || *number != std::floor(*number) || *number < low || *number > high) {
    fail(field, value,
         "it must be a whole number from " + std::to_string(static_cast<std::int64_t>(low)) + " to " +
             std::to_string(static_cast<std::int64_t>(high)));
  }
  return *number;
}

void Header::check() {
  if (bytes_.size() < kBlock)
    throw std::invalid_argument(file_.string() + ": has " + std::to_string(bytes_.size()) +
                                " bytes, and a header has 256; the file is truncated or of another format");
  read_kind();
  check_fixed_part();
  if (bytes_.size() < kBlock * (1 + signals_))
    throw std::invalid_argument(file_.string() + ": ends within the description of its " + std::to_string(signals_) +
                                " signals; the file is truncated");
  for (std::size_t signal = 0; signal < signals_; ++signal) check_signal(signal);
  check_size();
}

void Header::read_kind() {
  const std::string_view version = text(0, 8);
  is_bdf_ = version ==
            "\xff"
            "BIOSEMI";
  if (!is_bdf_ && trimmed(version) != "0")
    fail("version", version, "it must be 0 (EDF) or BIOSEMI after byte 255 (BDF)");
  const std::string_view reserved = text(192, 44);
  const std::string kind = is_bdf_ ? "BDF+" : "EDF+";
  if (reserved.starts_with(kind + "D"))
    fail("reserved", reserved, "an interrupted recording is not read; export it as a continuous one (" + kind + "C)");
}

void Header::check_fixed_part() {
  const std::pair<const char*, std::string_view> texts[] = {{"patient", text(8, 80)},
                                                            {"recording", text(88, 80)},
                                                            {"startdate", text(168, 8)},
                                                            {"starttime", text(176, 8)},
                                                            {"reserved", text(192, 44)}};
  for (const auto& [field, value] : texts) {
    if (!is_printable(value)) fail(field, value, "only printable ASCII characters are allowed");
  }
  signals_ = static_cast<std::size_t>(whole("number of signals", text(252, 4), 1, kMaxSignals));
  const auto header_bytes = static_cast<double>(kBlock * (1 + signals_));
  if (whole("header bytes", text(184, 8), 0, 1e8) != header_bytes)
    fail("header bytes", text(184, 8),
         "with " + std::to_string(signals_) + " signals it must be " +
             std::to_string(static_cast<std::uint64_t>(header_bytes)));
  const std::string_view records = text(236, 8);
  if (trimmed(records) == "-1") fail("number of records", records, "the recording was not finished; export it again");
  records_ = static_cast<std::uint64_t>(whole("number of records", records, 1, 99'999'999));
  const auto duration = number_in(text(244, 8));
  if (!duration || *duration <= 0 || *duration > 3600)
    fail("duration of a record", text(244, 8), "it must be above 0 and at most 3600 seconds");
}

void Header::check_signal(std::size_t signal) {
  const std::string_view label = of_signal(signal, 0, 16);
  const std::string name = "signals[" + std::to_string(signal) + "]";
  if (!is_printable(label)) fail(name + ".label", label, "only printable ASCII characters are allowed");
  const std::string_view dimension = of_signal(signal, 96, 8);
  if (!is_printable(dimension)) fail(name + ".dimension", dimension, "only printable ASCII is allowed; write uV");
  check_ranges(signal, name);
  const double samples = whole(name + ".samples", of_signal(signal, 216, 8), 1, 8'000'000);
  record_samples_ += static_cast<std::uint64_t>(samples);
}

void Header::check_ranges(std::size_t signal, const std::string& name) const {
  const std::string_view low = of_signal(signal, 104, 8), high = of_signal(signal, 112, 8);
  const auto physical_low = number_in(low), physical_high = number_in(high);
  if (!physical_low) fail(name + ".physical minimum", low, "it must be a number");
  if (!physical_high) fail(name + ".physical maximum", high, "it must be a number");
  if (*physical_low == *physical_high) fail(name + ".physical maximum", high, "it must differ from the minimum");
  const double limit = is_bdf_ ? 8'388'608 : 32'768;
  const std::string_view digital_low = of_signal(signal, 120, 8), digital_high = of_signal(signal, 128, 8);
  const double first = whole(name + ".digital minimum", digital_low, -limit, limit - 1);
  const double last = whole(name + ".digital maximum", digital_high, -limit, limit - 1);
  if (last <= first) fail(name + ".digital maximum", digital_high, "it must be above the minimum");
}

void Header::check_size() const {
  const std::uint64_t record_bytes = record_samples_ * (is_bdf_ ? 3 : 2);
  if (record_bytes > kMaxRecordBytes)
    throw std::invalid_argument(file_.string() + ": a record has " + std::to_string(record_bytes) + " bytes; at most " +
                                std::to_string(kMaxRecordBytes) + " are allowed");
  const std::uint64_t whole_size = kBlock * (1 + signals_) + records_ * record_bytes;
  if (whole_size != file_size_)
    fail("number of records", text(236, 8),
         "the header announces " + std::to_string(whole_size) + " bytes, and the file has " +
             std::to_string(file_size_) + "; it is truncated or damaged, copy or export it again");
  if (records_ * record_samples_ > kMaxFileSamples)
    fail("number of records", text(236, 8),
         "the file has " + std::to_string(records_ * record_samples_) + " samples, at most " +
             std::to_string(kMaxFileSamples) + " are read; cut it into parts");
}

}  // namespace

void check_edf_header(const std::filesystem::path& file) {
  Header(file).check();
}

}  // namespace tandem::eeg
