#include "lab/studies/prediction/series_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace tandem::lab {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{512} << 20U;
/// Maximum number of samples after resampling: 83 minutes at 200 Hz.
constexpr double kMaxSamples = 1e6;
constexpr std::size_t kTrajColumns = 7;

[[noreturn]] void fail(const std::string& origin, const std::string& complaint) {
  throw std::invalid_argument(origin + ": " + complaint);
}

std::string read_text(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error) fail(file.string(), "cannot be read (" + error.message() + "); check the path");
  if (size > kMaxBytes) fail(file.string(), "is larger than 512 MiB; cut it into parts");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) fail(file.string(), "cannot be read; check its permissions");
  return text.str();
}

/// Columns of equal length. The first column contains the times.
using Columns = std::vector<std::vector<double>>;

CsvTable resampled(const std::string& origin, const Columns& columns, const std::vector<std::string>& names,
                   double rate_hz, double time_unit_s) {
  const std::vector<double>& times = columns.front();
  if (times.size() < 2) fail(origin, "has " + std::to_string(times.size()) + " samples; it must have at least 2");
  const double length_s = (times.back() - times.front()) * time_unit_s;
  if (!(length_s * rate_hz <= kMaxSamples)) {
    fail(origin, "lasts " + std::to_string(length_s) + " s; with this many samples at " + std::to_string(rate_hz) +
                     " Hz it is too long: are its times in ms? (--time-unit ms)");
  }
  if (length_s * rate_hz < 2) {
    fail(origin, "lasts " + std::to_string(length_s) + " s, less than two samples at " + std::to_string(rate_hz) +
                     " Hz; check --time-unit and --rate");
  }
  CsvTable result{origin, names, Columns(names.size())};
  std::size_t next = 0;
  const double step = 1 / (rate_hz * time_unit_s);
  const auto count = static_cast<std::size_t>((times.back() - times.front()) / step) + 1;
  for (std::size_t i = 0; i < count; ++i) {
    const double time = times.front() + static_cast<double>(i) * step;
    while (next + 2 < times.size() && times[next + 1] <= time) ++next;
    const double u = std::clamp((time - times[next]) / (times[next + 1] - times[next]), 0.0, 1.0);
    for (std::size_t c = 0; c < names.size(); ++c) {
      const std::vector<double>& values = columns[c + 1];
      result.columns[c].push_back(values[next] + u * (values[next + 1] - values[next]));
    }
  }
  return result;
}

std::string place(const std::string& origin, std::size_t line) {
  return origin + ": line " + std::to_string(line);
}

/// Returns the first kTrajColumns numbers of a line, or fewer if the line is shorter.
std::vector<double> numbers_of(std::string_view line, const std::string& where) {
  std::vector<double> numbers;
  std::size_t at = 0;
  while (numbers.size() < kTrajColumns) {
    at = line.find_first_not_of(" \t,;\r", at);
    if (at == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" \t,;\r", at), line.size());
    const std::string_view word = line.substr(at, end - at);
    double number = 0;
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || rest != word.data() + word.size() || !std::isfinite(number)) {
      throw std::invalid_argument(where + ", column " + std::to_string(numbers.size() + 1) + " is \"" +
                                  std::string(word.substr(0, 40)) + "\"; it must be a finite number");
    }
    numbers.push_back(number);
    at = end;
  }
  return numbers;
}

bool is_comment(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return true;
  const char c = line[first];
  return c == '#' || c == '%' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool ends_with_unit(const std::string& name) {
  return name.ends_with("_n") || name.ends_with("_n_m");
}

std::vector<std::string> chosen_columns(const CsvTable& table, const std::string& list) {
  std::vector<std::string> chosen;
  if (list.empty()) {
    std::ranges::copy_if(table.names, std::back_inserter(chosen), ends_with_unit);
    if (chosen.empty()) fail(table.origin, "has no column that ends in _n or _n_m; name those to use with --columns");
    return chosen;
  }
  std::istringstream words(list);
  for (std::string name; std::getline(words, name, ',');) chosen.push_back(name);
  return chosen;
}

CsvTable series_of_csv(const CsvTable& table, double rate_hz, double time_unit_s, const std::string& wanted) {
  const std::vector<double>* times = table.find("t_s");
  if (times == nullptr) times = table.find("time_s");
  if (times == nullptr) fail(table.origin, "has no column t_s or time_s; it must have the samples' times");
  const std::vector<std::string> names = chosen_columns(table, wanted);
  Columns columns{*times};
  for (const std::string& name : names) columns.push_back(table.column(name));
  for (std::size_t row = 0; row < times->size(); ++row) {
    // Row 0 is line 2, because line 1 is the header.
    const std::string where = place(table.origin, row + 2);
    for (const auto& column : columns) {
      if (!std::isfinite(column[row])) fail(where, "a value is missing or not finite; cut the row out");
    }
    if (row > 0 && !((*times)[row] > (*times)[row - 1]))
      fail(where, "its time must be later than that of the row before");
  }
  return resampled(table.origin, columns, names, rate_hz, time_unit_s);
}

}  // namespace

CsvTable parse_traj(std::string_view text, const std::string& origin, double rate_hz, double time_unit_s) {
  Columns columns(4);
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (is_comment(line)) continue;
    const std::string where = place(origin, line_number);
    const std::vector<double> numbers = numbers_of(line, where);
    if (numbers.size() < kTrajColumns) {
      fail(where, "has " + std::to_string(numbers.size()) +
                      " numbers; it must have at least 7: time, position x y z, force x y z");
    }
    if (!columns[0].empty() && !(numbers[0] > columns[0].back())) {
      fail(where, "its time must be later than that of the line before");
    }
    columns[0].push_back(numbers[0]);
    for (std::size_t axis = 0; axis < 3; ++axis) columns[axis + 1].push_back(numbers[axis + 4]);
  }
  return resampled(origin, columns, {"force_x_n", "force_y_n", "force_z_n"}, rate_hz, time_unit_s);
}

CsvTable load_series(const std::filesystem::path& file, double rate_hz, double time_unit_s,
                     const std::string& columns) {
  if (file.extension() == ".traj") return parse_traj(read_text(file), file.string(), rate_hz, time_unit_s);
  return series_of_csv(read_csv(file), rate_hz, time_unit_s, columns);
}

}  // namespace tandem::lab
