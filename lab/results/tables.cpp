#include "lab/results/tables.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "lab/results/hdf5_file.hpp"

namespace tandem::lab {
namespace {

void append(std::string& line, double value) {
  if (std::isnan(value)) return;
  std::array<char, 32> text{};
  line.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

}  // namespace

void write_csv(const std::filesystem::path& file, const CsvTable& table) {
  std::ofstream out(file, std::ios::binary);
  std::string line;
  for (const std::string& name : table.names) line += (line.empty() ? "" : ",") + name;
  out << line << '\n';
  for (std::size_t row = 0; row < table.row_count(); ++row) {
    line.clear();
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      if (i > 0) line += ',';
      append(line, table.columns[i][row]);
    }
    out << line << '\n';
  }
  if (!out.flush()) throw std::runtime_error(file.string() + " could not be written; is the disk full?");
}

void write_tables_hdf5(const std::filesystem::path& file, const std::map<std::string, CsvTable>& tables,
                       const std::map<std::string, std::string>& about) {
  write_hdf5(file, [&](hid_t out) {
    for (const auto& [name, value] : about) write_hdf5_text(out, name, value);
    for (const auto& [name, table] : tables) write_hdf5_table(out, name, table);
  });
}

}  // namespace tandem::lab
