// Reads the tables of a document, so that a test can compare them with the code.
#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tandem::test {

using TableRow = std::map<std::string, std::string>;

inline std::vector<std::string> split_trimmed(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    const auto first = part.find_first_not_of(' ');
    parts.push_back(first == std::string::npos ? "" : part.substr(first, part.find_last_not_of(' ') - first + 1));
  }
  return parts;
}

/// Returns the rows of the first table after the line `heading`, by column name.
/// Fails   std::runtime_error if there is no table: a renamed heading must not look like an empty table
inline std::vector<TableRow> table_under(const std::string& file, const std::string& heading) {
  std::ifstream stream(file);
  std::string line;
  while (std::getline(stream, line) && line != heading) {
  }
  while (std::getline(stream, line) && (line.empty() || line.front() != '|')) {
  }
  const auto cells = [](const std::string& row) { return split_trimmed(row.substr(1, row.rfind('|') - 1) + " ", '|'); };
  if (line.empty() || line.front() != '|') throw std::runtime_error(file + " has no table under " + heading);
  const std::vector<std::string> names = cells(line);
  std::getline(stream, line);  // skips the line |---|
  std::vector<TableRow> rows;
  while (std::getline(stream, line) && !line.empty() && line.front() == '|') {
    const std::vector<std::string> values = cells(line);
    TableRow row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = i < values.size() ? values[i] : "";
    rows.push_back(row);
  }
  return rows;
}

}  // namespace tandem::test
