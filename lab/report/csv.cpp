#include "lab/report/csv.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <system_error>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr std::size_t kQuotedCharacters = 40;

std::string quoted(std::string_view text) {
  return "\"" + printable(shortened(text, kQuotedCharacters)) + "\"";
}

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// Removes the text before `separator`, and the separator, from the front of `rest`. Returns the removed text.
std::string_view pop_until(std::string_view& rest, char separator) {
  const std::size_t end = std::min(rest.find(separator), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

class CsvParser {
 public:
  explicit CsvParser(const std::string& origin) { table_.origin = origin; }

  CsvTable parse(std::string_view text) {
    while (!text.empty()) {
      ++line_;
      std::string_view line = pop_until(text, '\n');
      if (line.ends_with('\r')) line.remove_suffix(1);
      if (line_ == 1) {
        read_header(line);
      } else {
        read_row(line);
      }
    }
    if (line_ == 0) fail("is empty; its first line must name the columns");
    return std::move(table_);
  }

 private:
  void read_header(std::string_view line) {
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (count > kMaxCsvColumns) {
      fail(where() + " names " + std::to_string(count) + " columns; at most " + std::to_string(kMaxCsvColumns) +
           " are read");
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view name = pop_until(line, ',');
      if (!is_name(name)) {
        fail(where() + ", column " + std::to_string(i + 1) + " is named " + quoted(name) +
             "; a name must be of letters, digits and _");
      }
      if (table_.find(name) != nullptr) {
        fail(where() + ", column " + std::to_string(i + 1) + " is named " + quoted(name) + " a second time");
      }
      table_.names.emplace_back(name);
      table_.columns.emplace_back();
    }
  }

  void read_row(std::string_view line) {
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (count != table_.names.size()) {
      fail(where() + " has " + std::to_string(count) + " fields; the header names " +
           std::to_string(table_.names.size()));
    }
    if (table_.row_count() == kMaxCsvRows) {
      fail(where() + " is one row too many; at most " + std::to_string(kMaxCsvRows) + " are read");
    }
    for (std::size_t i = 0; i < count; ++i) table_.columns[i].push_back(number(pop_until(line, ','), i));
  }

  double number(std::string_view field, std::size_t column) const {
    if (field.empty()) return std::numeric_limits<double>::quiet_NaN();
    double value = 0;
    const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
    if (result.ec != std::errc() || result.ptr != field.data() + field.size()) {
      fail(where() + ", column " + std::to_string(column + 1) + " (" + table_.names[column] + ") is " + quoted(field) +
           "; it must be a number");
    }
    return value;
  }

  std::string where() const { return "line " + std::to_string(line_); }
  /// Throws an error whose text is the file name followed by `what`. They are separated by ": " if `what` begins with a
  /// line number, and by a space otherwise.
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(table_.origin + (what.starts_with("line ") ? ": " : " ") + what);
  }

  CsvTable table_;
  std::size_t line_ = 0;
};

}  // namespace

std::string csv_name(std::string text) {
  for (char& c : text) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!is_plain) c = '_';
  }
  return text;
}

const std::vector<double>* CsvTable::find(std::string_view name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? nullptr : &columns[static_cast<std::size_t>(found - names.begin())];
}

const std::vector<double>& CsvTable::column(std::string_view name) const {
  if (const auto* values = find(name)) return *values;
  throw std::invalid_argument(origin + ": there is no column " + std::string(name) + "; its first line must name it");
}

CsvTable parse_csv(std::string_view text, const std::string& origin) {
  return CsvParser(origin).parse(text);
}

CsvTable read_csv(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) throw std::invalid_argument(file.string() + " cannot be read (" + error.message() + "); check the path");
  if (bytes > kMaxCsvBytes) {
    throw std::invalid_argument(file.string() + " has " + std::to_string(bytes) + " bytes; at most " +
                                std::to_string(kMaxCsvBytes) + " are read");
  }
  std::string text(bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(bytes));
  if (!in) throw std::invalid_argument(file.string() + " cannot be read; check its rights");
  return parse_csv(text, file.string());
}

}  // namespace tandem::lab
