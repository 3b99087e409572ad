// Writes tables of numbers as files for analysis: one CSV file for each table, or one HDF5 file for all tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Writes a table as CSV: names, then rows. NaN becomes an empty cell. The numbers have enough digits to be read back
/// exactly.
/// Fails   std::runtime_error: the file cannot be written
void write_csv(const std::filesystem::path& file, const CsvTable& table);

/// Writes tables as HDF5: a group for each table and a dataset for each of its columns. The entries of `about` become
/// attributes of the file.
/// Fails   std::runtime_error: the file cannot be written
void write_tables_hdf5(const std::filesystem::path& file, const std::map<std::string, CsvTable>& tables,
                       const std::map<std::string, std::string>& about);

}  // namespace tandem::lab
