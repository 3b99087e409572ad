// Time series as the client writes them: a header of unit-suffixed names, then numbers. The files come from
// other programs and machines, so everything is bounded and every complaint says where.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::lab {

/// More than these is refused: twenty minutes at 1 kHz with room to spare.
inline constexpr std::size_t kMaxCsvBytes = std::size_t{512} << 20U;  ///< of a file
inline constexpr std::size_t kMaxCsvColumns = 256;
inline constexpr std::size_t kMaxCsvRows = 2'000'000;

/// Columns of equal length.
struct CsvTable {
  std::string origin;  ///< the file, for messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  std::size_t row_count() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Null when there is no such column.
  const std::vector<double>* find(std::string_view name) const;
  /// Fails   std::invalid_argument naming file and column, when there is no such column
  const std::vector<double>& column(std::string_view name) const;
};

/// `text` as a column's name: whatever is no letter and no digit becomes _.
std::string csv_name(std::string text);

/// Parses comma-separated text. An empty field is NaN, as are "nan" and "-nan"; "inf" is infinite.
///
/// In      names of letters, digits and _; LF or CRLF; no quotes, no comments
/// Fails   std::invalid_argument: "bob.csv: line 7, column 3 (force_n) is \"x\"; it must be a number"
/// Cost    O(bytes)
CsvTable parse_csv(std::string_view text, const std::string& origin);
CsvTable read_csv(const std::filesystem::path& file);

}  // namespace tandem::lab
