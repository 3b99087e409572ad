// Time series in the format of the client's CSV files: a header line with names and units, then lines of numbers. The
// files may come from other programs and machines. Therefore all sizes are limited, and every error message contains
// the position in the file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::lab {

/// Limits of a file. A trace of twenty minutes at 1 kHz stays well below these limits.
inline constexpr std::size_t kMaxCsvBytes = std::size_t{512} << 20U;  ///< maximum size of a file
inline constexpr std::size_t kMaxCsvColumns = 256;
inline constexpr std::size_t kMaxCsvRows = 2'000'000;

/// A table of named columns of equal length.
struct CsvTable {
  std::string origin;  ///< file name, for error messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  std::size_t row_count() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Returns the column with this name, or null if there is none.
  const std::vector<double>* find(std::string_view name) const;
  /// Returns the column with this name.
  /// Fails   std::invalid_argument naming file and column, if there is no such column
  const std::vector<double>& column(std::string_view name) const;
};

/// Converts `text` to a column name: every character that is not a letter or digit becomes _.
std::string csv_name(std::string text);

/// Parses comma-separated text. An empty field, "nan" and "-nan" give NaN; "inf" gives infinity.
///
/// In      text  text of a CSV file. Column names consist of letters, digits and _. Lines end with LF or CRLF. Quotes
///         and comments are not supported
/// Fails   std::invalid_argument: "bob.csv: line 7, column 3 (force_n) is \"x\"; it must be a number"
/// Cost    O(bytes)
CsvTable parse_csv(std::string_view text, const std::string& origin);
CsvTable read_csv(const std::filesystem::path& file);

}  // namespace tandem::lab
