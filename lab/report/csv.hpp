// Time series in the format of the client: a header of names with units, then numbers. The files are from other
// programs and machines, so everything is bounded and every error names its location.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::lab {

/// Limits. They leave reserve beyond twenty minutes at 1 kHz.
inline constexpr std::size_t kMaxCsvBytes = std::size_t{512} << 20U;  ///< per file
inline constexpr std::size_t kMaxCsvColumns = 256;
inline constexpr std::size_t kMaxCsvRows = 2'000'000;

/// Columns of equal length.
struct CsvTable {
  std::string origin;  ///< file name, for messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  std::size_t row_count() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Returns null if there is no such column.
  const std::vector<double>* find(std::string_view name) const;
  /// Fails   std::invalid_argument naming file and column, if there is no such column
  const std::vector<double>& column(std::string_view name) const;
};

/// Converts `text` to a column name: every character that is not a letter or digit becomes _.
std::string csv_name(std::string text);

/// Parses comma-separated text. An empty field is NaN, as are "nan" and "-nan"; "inf" is infinite.
///
/// In      text  names of letters, digits and _; LF or CRLF; no quotes, no comments
/// Fails   std::invalid_argument: "bob.csv: line 7, column 3 (force_n) is \"x\"; it must be a number"
/// Cost    O(bytes)
CsvTable parse_csv(std::string_view text, const std::string& origin);
CsvTable read_csv(const std::filesystem::path& file);

}  // namespace tandem::lab
